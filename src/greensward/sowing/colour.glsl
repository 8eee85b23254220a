// Colour of the grass by place, in place of that of its species, and the part of the ground that lets any grow.
#include "shaders/noise.glsl"
#include "ground/ground.glsl"
#include "ground/soil.glsl"
#include "layout/Sward"
#include "layout/Tints"

uniform sampler2D vegetation_map;

#ifdef COLOUR_GROUND
uniform sampler2DArray green_soils;  // square roots of colours; 1 where grass grows
uniform sampler2D green_map;

// At a root, where `footprint_m` is 0, the texel there; else the mean over a footprint
vec4 soilGreen(vec2 xz, float footprint_m) {
    int tile = tileAt(xz);
    vec2 uv = likeliestCopy(tile, xz), size = vec2(textureSize(green_soils, 0).xy);
    if (footprint_m == 0.0) return texelFetch(green_soils, ivec3(min(fract(uv) * size, size - 1.0), tile + 1), 0);
    return textureLod(green_soils, vec3(uv, float(tile + 1)), log2(max(footprint_m * soilPerM(tile) * max(size.x, size.y), 1.0)));
}

vec4 mapGreen(vec2 xz, float footprint_m) {
    vec2 uv = mapUv(xz), size = vec2(textureSize(green_map, 0));
    if (footprint_m == 0.0) return texelFetch(green_map, ivec2(min(uv * size, size - 1.0)), 0);
    vec2 perM = size / ground.size_m;
    return textureLod(green_map, uv, log2(max(footprint_m * max(perM.x, perM.y), 1.0)));
}

// The terrain map covers the soil by its alpha, as on the ground; of both only what is green counts. Linear colour; part that
// is green.
vec4 groundGreen(vec2 xz, float footprint_m) {
    vec4 soil = soilGreen(xz, footprint_m), map = mapGreen(xz, footprint_m);
    float cover = textureLod(terrain_map, mapUv(xz), 0.0).a;
    vec2 share = vec2((1.0 - cover) * soil.a, cover * map.a);
    float green = share.x + share.y;
    return vec4((share.x * soil.rgb * soil.rgb + share.y * map.rgb * map.rgb) / max(green, 1e-6), green);
}
#endif

// Part of the ground that is green enough for grass
float greenAt(vec2 xz, float footprint_m) {
#ifdef COLOUR_GROUND
    return groundGreen(xz, footprint_m).a;
#else
    return 1.0;
#endif
}

#ifdef COLOUR_NOISE
// Tillman 2013, section 2.1.5: each channel is a blend of octaves of noise with parameters of its own. What is finer than a
// footprint is left out.
vec3 noiseColour(vec2 xz, float footprint_m) {
    vec3 blend = vec3(0.0);
    for (int i = 0; i < tints.count; i++) {
        vec4 noise = tints.noises[2 * i];
        blend += tints.noises[2 * i + 1].rgb
            * octaves(inWorld(xz) / noise.x, sward.seed + 7001u + 331u * uint(i), int(noise.w), noise.y, noise.z, footprint_m / noise.x);
    }
    return mix(tints.low.rgb, tints.high.rgb, clamp(0.5 + blend, 0.0, 1.0));
}
#endif

// Colour that the scene gives grass at a place, in w the strength with which it replaces the species': of `[colour]`, and
// over that of the vegetation map
vec4 paintedAt(vec2 xz, float footprint_m) {
    vec4 map = textureLod(vegetation_map, mapUv(xz), 0.0);
#if defined(COLOUR_NOISE) || defined(COLOUR_GROUND)
#ifdef COLOUR_NOISE
    vec4 own = vec4(noiseColour(xz, footprint_m), tints.low.a);
#else
    vec4 own = vec4(groundGreen(xz, footprint_m).rgb, tints.low.a);
#endif
    float under = (1.0 - map.a) * own.a, all = map.a + under;
    return vec4((map.a * map.rgb + under * own.rgb) / max(all, 1e-6), all);
#else
    return map;
#endif
}
