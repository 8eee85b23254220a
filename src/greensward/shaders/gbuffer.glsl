// Layout of the G-buffer: how a surface is packed, and how a full-screen pass reads it.
#include "shaders/octahedral.glsl"
#include "layout/SurfaceClass"
#include "layout/SurfaceBits"
#include "layout/View"

uniform sampler2D gbuffer_colour;
uniform sampler2D gbuffer_normal;
uniform sampler2D gbuffer_motion;
uniform usampler2D gbuffer_surface;  // class and id; bits of the linear depth

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

uvec2 packSurface(uint surfaceClass, uint bladeNumber, float depth_m) {
    return uvec2(surfaceClass << BLADE_NUMBER_BITS | bladeNumber, floatBitsToUint(depth_m));
}

uint surfaceClassOf(uvec2 surface) { return surface.x >> BLADE_NUMBER_BITS; }

uint bladeNumberOf(uvec2 surface) { return surface.x & BLADE_NUMBER_MASK; }

float depthOf(uvec2 surface) { return uintBitsToFloat(surface.y); }

uint classAt(ivec2 pixel) { return surfaceClassOf(texelFetch(gbuffer_surface, pixel, 0).rg); }

float depthAt(ivec2 pixel) { return depthOf(texelFetch(gbuffer_surface, pixel, 0).rg); }

vec2 sampleOf(ivec2 pixel) { return (vec2(pixel) + 0.5) * view.size_px.zw * 2.0 - 1.0 - view.jitter; }

// Through the pixel's sample, one metre along the view axis
vec3 rayThrough(ivec2 pixel) {
    vec2 ndc = sampleOf(pixel);
    return view.middle_ray.xyz + ndc.x * view.right_ray.xyz + ndc.y * view.up_ray.xyz;
}

// Where that ray starts, at depth 0, in relative space: the eye, or in a parallel view a point beside it
vec3 startOf(ivec2 pixel) {
    vec2 ndc = sampleOf(pixel);
    return view.middle_start_rs.xyz + ndc.x * view.right_start.xyz + ndc.y * view.up_start.xyz;
}

vec3 worldAt(ivec2 pixel) { return view.origin_ws.xyz + startOf(pixel) + rayThrough(pixel) * depthAt(pixel); }
