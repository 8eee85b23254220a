// The ground without a raster stage: by a ray through each pixel.
#include "shaders/gbuffer.glsl"
#include "ground/march.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(rg32f) writeonly uniform image2D motion_image;
layout(rg32ui) uniform uimage2D surface_image;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy)))) return;
    vec3 start_rs = startOf(pixel), ray = rayThrough(pixel);
    float depth = march(view.origin_ws.xyz + start_rs, ray, range_m.x, 0.0);
    if (depth < range_m.x || depth > range_m.y || depth >= depthOf(imageLoad(surface_image, pixel).rg)) return;
    vec4 previousClip = view.previous_clip_from_relative * vec4(start_rs + ray * depth, 1.0);
    imageStore(motion_image, pixel, vec4(packMotion(vec2(pixel) + 0.5, previousClip), 0.0, 0.0));
    imageStore(surface_image, pixel, uvec4(packSurface(CLASS_GROUND, 0u, depth), 0u, 0u));
}
