// Water over what was lit: planar reflection, refraction of what lies below, and the place of its surface.
#include "shaders/gbuffer.glsl"
#include "shaders/noise.glsl"
#include "passes/sky/surroundings.glsl"
#include "layout/Water"

uniform sampler2D mirrored;       // radiance of the mirrored scene, at the same place of the picture
uniform usampler2D mirrored_surface;  // as gbuffer_surface
uniform sampler2D radiance;

const int WAVES = 10;
const float STEEPEST = 0.32;
const float F0 = 0.02;  // of water seen from above

// Slope of the surface: sines of ever shorter length, which run as waves in deep water do, at sqrt(g k). What a pixel cannot
// resolve is left out.
vec2 slopeAt(vec2 xz, float footprint_m) {
    vec2 slope = vec2(0.0);
    float length_m = water.ripple_m;
    for (int i = 0; i < WAVES; i++) {
        vec3 random = unit(hash3(uvec3(uint(i), 77u, 5u)));
        float turn = 4.2 * (random.x - 0.5) + 0.7, k = 2.0 * PI / length_m;
        vec2 direction = vec2(cos(turn), sin(turn));
        float resolved = 1.0 - smoothstep(0.2, 0.6, footprint_m / length_m);
        slope += resolved * direction * cos(k * dot(direction, xz) - sqrt(9.81 * k) * water.time_s + 6.2832 * random.y);
        length_m *= 0.79;
    }
    // breezes touch a lake in patches, and leave others calm
    float breeze = 0.6 + 0.55 * simplex(xz * 0.11 / max(water.ripple_m, 0.1) + vec2(0.03, -0.02) * water.time_s, 401u);
    return STEEPEST * water.ripple * max(breeze, 0.12) / float(WAVES) * 2.0 * slope;
}

// Schlick 1994
float fresnel(float cosine) { return F0 + (1.0 - F0) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0); }

// Beer-Lambert: part of the light that is left after a path through the water
float clear(float path_m) { return exp(-path_m / water.clarity_m); }

vec3 mirroredAt(ivec2 pixel, vec3 at, vec3 towards) {
    if (water.reflects == 0) return skyFrom(at.y, vec3(towards.x, abs(towards.y), towards.z));
    // what a ripple shows lies about as far away as what a mirror would show here
    vec2 uv = (vec2(pixel) + 0.5) * view.size_px.zw;
    float away = depthOf(texelFetch(mirrored_surface, ivec2(uv * vec2(textureSize(mirrored_surface, 0))), 0).rg);
    vec3 at_rs = at - view.origin_ws.xyz;
    float far = clamp(away - dot(view.axis_rs.xyz, at_rs) - view.axis_rs.w, 0.5, 60.0);
    vec3 shown = at_rs + towards * far;
    shown.y -= 2.0 * towards.y * far;
    vec4 clip = view.clip_from_relative * vec4(shown, 1.0);
    vec2 there = clip.w > 0.0 ? 0.5 + 0.5 * clip.xy / clip.w : uv;
    return textureLod(mirrored, clamp(there, 0.5 * view.size_px.zw, 1.0 - 0.5 * view.size_px.zw), 0.0).rgb;
}

// Depth at which the pixel's ray meets the level of the water
float waterDepthAt(ivec2 pixel) {
    return (water.level_m - view.origin_ws.y - startOf(pixel).y) / min(rayThrough(pixel).y, -1e-9);
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    result[0] = texelFetch(radiance, pixel, 0);
    result[1] = vec4(0.0);
    vec3 ray = rayThrough(pixel), start = view.origin_ws.xyz + startOf(pixel);
    float depth_m = depthAt(pixel), t = waterDepthAt(pixel);
    if (ray.y >= 0.0 || t >= depth_m || t > water.farthest_m) return true;

    vec3 at = start + ray * t, direction = normalize(ray);
    float pixel_m = t * view.pixel_m.x + view.pixel_m.y, slant = max(-direction.y, 0.02);
    vec2 slope = slopeAt(at.xz, pixel_m / sqrt(slant));
    vec3 normal = normalize(vec3(-slope.x, 1.0, -slope.y));
    // a wave never shows its far side
    if (dot(normal, direction) > -0.02) normal = normalize(normal - (dot(normal, direction) + 0.02) * direction);
    vec3 towards = reflect(direction, normal);
    towards = normalize(vec3(towards.x, max(towards.y, 0.005), towards.z));

    // bent by the surface, if that still shows what lies below
    float through = (depth_m - t) * length(ray);
    ivec2 bent = pixel + ivec2(slope * clamp(through, 0.0, 1.0) * 0.25 / max(pixel_m, 1e-4));
    bent = clamp(bent, ivec2(0), ivec2(view.size_px.xy) - 1);
    float bentDepth = depthAt(bent), bentT = waterDepthAt(bent);
    bool below = bentT < bentDepth && rayThrough(bent).y < 0.0;
    vec3 bottom = texelFetch(radiance, below ? bent : pixel, 0).rgb;
    if (below) through = (bentDepth - bentT) * length(ray);
    if (isinf(through)) bottom = vec3(0.0);

    vec3 sun = light.sun_here.rgb * max(light.to_sun.y, 0.0);
    vec3 deep = throughAir(water.colour.rgb / PI * (skyIrradiance(vec3(0.0, 1.0, 0.0)) + sun), at, direction, t * length(ray));
    vec3 seen = mix(deep, bottom, clear(through));
    float shore = smoothstep(0.0, 0.12, through);
    result[0].rgb = mix(seen, mirroredAt(pixel, at, towards), fresnel(-dot(direction, normal)) * shore);
    result[1] = vec4(normal, t);
    return true;
}
