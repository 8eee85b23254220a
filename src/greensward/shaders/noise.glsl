#include "shaders/hash.glsl"

// Two-dimensional simplex noise (Perlin 2001, after Gustavson 2005, "Simplex noise demystified"), about -1 to 1.
// Gradients come from an integer hash instead of a permutation table, so the noise never repeats.
float simplexCorner(vec2 d, ivec2 cell, uint seed) {
    float t = 0.5 - dot(d, d);
    vec2 gradient = 2.0 * unit(hash3(uvec3(uvec2(cell), seed))).xy - 1.0;
    t = max(t, 0.0);
    t *= t;
    return t * t * dot(gradient, d);
}

// `p` is counted from the corner of the cell `from`
float simplex(vec2 p, ivec2 from, uint seed) {
    const float F = 0.36602540378;  // (sqrt(3) - 1) / 2
    const float G = 0.21132486540;  // (3 - sqrt(3)) / 6
    vec2 cell = floor(p + (p.x + p.y) * F);
    vec2 d0 = p - cell + (cell.x + cell.y) * G;
    ivec2 i = ivec2(cell) + from;
    ivec2 middle = d0.x > d0.y ? ivec2(1, 0) : ivec2(0, 1);
    vec2 d1 = d0 - vec2(middle) + G;
    vec2 d2 = d0 - 1.0 + 2.0 * G;
    // 99.2 would bring the sum of unit gradients to 1 at most; these are shorter by a fifth on average
    return 118.0 * (simplexCorner(d0, i, seed) + simplexCorner(d1, i + middle, seed) + simplexCorner(d2, i + 1, seed));
}

float simplex(vec2 p, uint seed) { return simplex(p, ivec2(0), seed); }

// Octaves blended with different seeds and turned against each other, so that no single frequency shows
// (Tillman 2013, section 2.1.5). Those finer than a footprint, in units of p, fade to their mean.
float octaves(vec2 p, uint seed, int count, float gain, float lacunarity, float footprint) {
    float sum = 0.0, weight = 1.0, total = 0.0;
    for (int i = 0; i < count; i++) {
        sum += weight * (1.0 - smoothstep(0.15, 0.6, footprint)) * simplex(p, seed + uint(i) * 101u);
        total += weight;
        weight *= gain;
        p = lacunarity * vec2(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y);
        footprint *= lacunarity;
    }
    return sum / total;
}

float octaves(vec2 p, uint seed, int count, float gain, float lacunarity) {
    return octaves(p, seed, count, gain, lacunarity, 0.0);
}
