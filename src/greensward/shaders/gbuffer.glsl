// The G-buffer's layout: how a surface is packed, and how a full-screen pass reads it.
#include "shaders/octahedral.glsl"
#include "block/View"

const uint CLASS_SKY = 0u, CLASS_GROUND = 1u, CLASS_GRASS = 2u, CLASS_FLOWER = 3u, CLASS_OBJECT = 4u, CLASS_WATER = 5u;

// the square root keeps dark greens from banding in 8 bits
vec4 packColour(vec3 baseColour, float transmittance) {
    return vec4(sqrt(clamp(baseColour, 0.0, 1.0)), transmittance);
}

vec4 packNormal(vec3 normal_ws, float occlusion, float roughness) {
    return vec4(octahedralEncode(normal_ws), occlusion, roughness);
}

// From where the surface was a frame ago to the pixel's sample, in pixels
vec2 packMotion(vec2 pixel_centre, vec4 previousClip) {
    vec2 now = pixel_centre * view.size_px.zw * 2.0 - 1.0 - view.jitter;
    return 0.5 * (now - previousClip.xy / previousClip.w) * view.size_px.xy;
}

uint packId(uint surfaceClass, uint bladeId) { return surfaceClass << 27u | bladeId; }

// From the eye through the pixel's sample, one metre along the view axis
vec3 rayThrough(ivec2 pixel) {
    vec2 ndc = (vec2(pixel) + 0.5) * view.size_px.zw * 2.0 - 1.0 - view.jitter;
    return view.corner_ray.xyz + ndc.x * view.right_ray.xyz + ndc.y * view.up_ray.xyz;
}

#ifdef TARGETS
layout(binding = 13) uniform usampler2D gId;
layout(binding = 14) uniform sampler2D gDepth;

uint classAt(ivec2 pixel) { return texelFetch(gId, pixel, 0).r >> 27u; }

vec3 worldAt(ivec2 pixel) { return view.eye_ws.xyz + rayThrough(pixel) * texelFetch(gDepth, pixel, 0).r; }
#endif
