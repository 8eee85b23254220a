// Soils of the ground and its tiles, repeated without visible tiling: three copies of a texture, shifted at random per hexagon
// (Heitz & Neyret 2018, "High-Performance By-Example Noise"; hexagons after Mikkelsen 2022).
#include "shaders/hash.glsl"
#include "ground/ground.glsl"

uniform sampler2D terrain_map;

// The last tile that a place lies in, -1 where there is none
int tileAt(vec2 xz) {
    int tile = -1;
#ifdef TILES
    vec2 world = inWorld(xz);
    for (int i = 0; i < ground.tiles; i++) {
        vec4 area = ground.tile_area_m[i];
        if (all(greaterThanEqual(world, area.xy)) && all(lessThan(world, area.zw))) tile = i;
    }
#endif
    return tile;
}

// Copies of a tile's texture on a metre
float soilPerM(int tile) { return tile < 0 ? ground.soil_per_m : ground.tile_mean[max(tile, 0)].w; }

// Where a place lies on the texture of its tile, in copies: of the soil, which goes on for ever, less whole copies
vec2 soilUv(int tile, vec2 xz) { return tile < 0 ? xz * ground.soil_per_m + ground.soil_anchor : inWorld(xz) * soilPerM(tile); }

// The three hexagons around a place, and the weight of each
struct Hexagons { ivec2 a, b, c; vec3 weight; };

Hexagons hexagonsAt(int tile, vec2 xz) {
    const mat2 skew = mat2(1.0, 0.0, -0.57735027, 1.15470054);
    vec2 s = tile < 0 ? skew * (xz * ground.soil_per_m) * 1.7 + ground.in_hexagon : skew * soilUv(tile, xz) * 1.7;
    ivec2 base = ivec2(floor(s)) + (tile < 0 ? ground.hexagon : ivec2(0));
    vec3 t = vec3(fract(s), 0.0);
    t.z = 1.0 - t.x - t.y;
    Hexagons h;
    h.weight = t.z > 0.0 ? vec3(t.z, t.y, t.x) : vec3(-t.z, 1.0 - t.y, 1.0 - t.x);
    h.a = t.z > 0.0 ? base : base + ivec2(1, 1);
    h.b = t.z > 0.0 ? base + ivec2(0, 1) : base + ivec2(1, 0);
    h.c = t.z > 0.0 ? base + ivec2(1, 0) : base + ivec2(0, 1);
    return h;
}

vec2 shiftOf(ivec2 hexagon) { return unit(hash3(uvec3(uvec2(hexagon), 1u))).xy; }

// Where on the texture lies what shows most
vec2 likeliestCopy(int tile, vec2 xz) {
    Hexagons h = hexagonsAt(tile, xz);
    bool first = h.weight.x >= h.weight.y && h.weight.x >= h.weight.z;
    return soilUv(tile, xz) + shiftOf(first ? h.a : h.weight.y >= h.weight.z ? h.b : h.c);
}
