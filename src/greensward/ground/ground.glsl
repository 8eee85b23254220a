// Bilinear height and normal of the ground; the twin of ground/height_field.py.
#include "layout/Ground"

uniform sampler2D ground_heights;

const int REPEAT = 2;

// Beyond the edge the ground goes on mirrored, or repeated.
float folded(float at, float last) {
    return ground.beyond == REPEAT ? mod(at, last) : last - abs(last - mod(at, 2.0 * last));
}

// Where a point counted from the anchor lies in the world: exact enough for what is smooth
vec2 inWorld(vec2 xz) { return xz + ground.anchor_m; }

float groundHeight(vec2 xz) {
    vec2 last = ground.samples - 1.0;
    vec2 at = (xz + ground.folded_anchor_m + 0.5 * ground.size_m) * ground.samples_per_m;
    at = vec2(folded(at.x, last.x), folded(at.y, last.y));
    vec2 corner = min(floor(at), last - 1.0);
    vec2 f = at - corner;
    ivec2 c = ivec2(corner);
    float nw = texelFetch(ground_heights, c, 0).r, ne = texelFetch(ground_heights, c + ivec2(1, 0), 0).r;
    float sw = texelFetch(ground_heights, c + ivec2(0, 1), 0).r, se = texelFetch(ground_heights, c + ivec2(1, 1), 0).r;
    return mix(mix(nw, ne, f.x), mix(sw, se, f.x), f.y);
}

vec3 groundNormal(vec2 xz) {
    vec2 cell = 1.0 / ground.samples_per_m;
    float dx = groundHeight(xz + vec2(cell.x, 0.0)) - groundHeight(xz - vec2(cell.x, 0.0));
    float dz = groundHeight(xz + vec2(0.0, cell.y)) - groundHeight(xz - vec2(0.0, cell.y));
    return normalize(vec3(-dx * 0.5 * ground.samples_per_m.x, 1.0, -dz * 0.5 * ground.samples_per_m.y));
}

// Maps cover the ground exactly; beyond its edge they go on like the heights.
vec2 mapUv(vec2 xz) {
    vec2 uv = (xz + ground.folded_anchor_m) / ground.size_m + 0.5;
    return vec2(folded(uv.x, 1.0), folded(uv.y, 1.0));
}
