// The ground without a raster stage: by a ray through each pixel.
#include "shaders/gbuffer.glsl"
#include "ground/march.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(rg32f, binding = 2) writeonly uniform image2D motionImage;
layout(r32ui, binding = 3) writeonly uniform uimage2D idImage;
layout(r32f, binding = 4) uniform image2D depthImage;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy)))) return;
    vec3 eye = view.eye_ws.xyz, ray = rayThrough(pixel);
    float depth = march(eye, ray, range_m.x, 0.0);
    if (depth < range_m.x || depth > range_m.y || depth >= imageLoad(depthImage, pixel).r) return;
    vec4 previousClip = view.previous_clip_from_relative * vec4(view.eye_rs.xyz + ray * depth, 1.0);
    imageStore(motionImage, pixel, vec4(packMotion(vec2(pixel) + 0.5, previousClip), 0.0, 0.0));
    imageStore(idImage, pixel, uvec4(packId(CLASS_GROUND, 0u)));
    imageStore(depthImage, pixel, vec4(depth));
}
