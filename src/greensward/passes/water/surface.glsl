// The surface of the water where water.glsl found it.
#include "shaders/emit.glsl"
#include "layout/Water"

uniform sampler2D found;  // normal; depth, 0 where there is none

bool surfaceAt(ivec2 pixel, out Surface s, out float depth_m) {
    vec4 here = texelFetch(found, pixel, 0);
    depth_m = here.w;
    s.baseColour = water.colour.rgb;
    s.transmittance = 0.0;
    s.normal_ws = here.xyz;
    s.occlusion = 1.0;
    s.roughness = 0.05;
    s.surfaceClass = CLASS_WATER;
    s.bladeNumber = 0u;
    s.previousClip = view.previous_clip_from_relative * vec4(startOf(pixel) + rayThrough(pixel) * depth_m, 1.0);
    return depth_m > 0.0;
}
