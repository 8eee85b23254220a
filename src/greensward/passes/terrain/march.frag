// The ground by a ray through each pixel, among what is drawn in triangles.
#include "shaders/emit.glsl"
#ifdef MARCHED
uniform sampler2D ground_depth;  // as depth.glsl finds it
uniform vec2 range_m;
#else
#include "ground/march.glsl"
#endif

uniform bool reversed_depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 start_rs = startOf(pixel), ray = rayThrough(pixel);
#ifdef MARCHED
    float depth = texelFetch(ground_depth, pixel, 0).r;
#else
    float depth = march(view.origin_ws.xyz + start_rs, ray, range_m.x, 0.0);
#endif
    if (depth < range_m.x || depth > range_m.y) discard;
    vec4 position_rs = vec4(start_rs + ray * depth, 1.0);
    vec4 clip = view.jittered_clip_from_relative * position_rs;
    gl_FragDepth = reversed_depth ? clip.z / clip.w : 0.5 * clip.z / clip.w + 0.5;
    Surface s;
    s.baseColour = vec3(0.0);  // painted by material.glsl, once per pixel that shows it
    s.transmittance = 0.0;
    s.normal_ws = vec3(0.0, 1.0, 0.0);
    s.occlusion = 1.0;
    s.roughness = 1.0;
    s.surfaceClass = CLASS_GROUND;
    s.bladeNumber = 0u;
    s.previousClip = view.previous_clip_from_relative * position_rs;
    emitSurface(s, depth);
}
