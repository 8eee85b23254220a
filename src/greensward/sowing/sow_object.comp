// Sows groups of an object's triangles, in the object's own space. Of a tile, x is the first triangle and z how many there are.
#include "sowing/grow.glsl"
#include "sowing/tiles.glsl"
#include "layout/ObjectCorner"
#include "layout/ObjectTriangle"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Corners { ObjectCorner corners[]; };
layout(std430) readonly buffer Triangles { ObjectTriangle triangles[]; };
uniform sampler2D object_density_map;

uniform uint salt;  // differs from object to object
uniform float density_per_m2;

// The first triangle of the tile that ends beyond this part of its area
uint triangleAt(Tile tile, float part) {
    uint low = uint(tile.x), high = low + uint(tile.z) - 1u;
    while (low < high) {
        uint middle = (low + high) >> 1u;
        if (triangles[middle].end > part) high = middle;
        else low = middle + 1u;
    }
    return low;
}

// Worley noise as in clump.glsl, of 3 x 3 x 3 cells
uvec3 clumpIn(vec3 at) {
    ivec3 cell = ivec3(floor(at / sward.clump_m));
    uvec3 nearest = uvec3(0u);
    float best = 1e9;
    for (int k = 0; k < 27; k++) {
        ivec3 here = cell + ivec3(k % 3, k / 3 % 3, k / 9) - 1;
        uvec3 random = hash3(uvec3(here) + (sward.seed ^ 0x51ed270bu));
        float d = distance((vec3(here) + unit(random)) * sward.clump_m, at);
        if (d < best) { best = d; nearest = random; }
    }
    return nearest;
}

// Additive recurrence with the plastic number (Roberts 2018): its first number goes along the tile's area and so
// chooses a triangle, and how far it goes into that one is, with the second, a place in it. So any prefix is a fair
// sample. Jittered by the spacing of the points in the triangle so far, as on the ground.
bool grow(Tile tile, uint j, out Blade blade) {
    uvec3 shift = hash3(uvec3(uint(tile.x), salt, sward.seed ^ 0x9e3779b9u));
    uvec3 random = hash3(uvec3(uint(tile.x), j, salt + sward.seed * 0x9e3779b9u));
    vec2 even = vec2((j * uvec2(3242174889u, 2447445414u) + shift.xy) >> 8u) * (1.0 / 16777216.0);
    uint index = triangleAt(tile, even.x);
    ObjectTriangle t = triangles[index];
    float start = index > uint(tile.x) ? triangles[index - 1u].end : 0.0, share = max(t.end - start, 1e-9);
    vec2 jitter = (unit(random).xy - 0.5) * 1.4 * inversesqrt(float(j) * share + 1.0);
    vec2 place = fract(vec2(clamp((even.x - start) / share, 0.0, 1.0), even.y) + jitter);
    float across = sqrt(place.x);
    vec3 weight = vec3(1.0 - across, across * (1.0 - place.y), across * place.y);

    ObjectCorner a = corners[t.a], b = corners[t.b], c = corners[t.c];
    vec2 uv = mat3x2(a.u, a.v, b.u, b.v, c.u, c.v) * weight;
    float density = dot(vec3(a.density, b.density, c.density), weight) * textureLod(object_density_map, vec2(uv.x, 1.0 - uv.y), 0.0).r;
    GrowthPoint point;
    point.root = mat3(a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z) * weight;
    point.up = normalize(mat3(a.nx, a.ny, a.nz, b.nx, b.ny, b.nz, c.nx, c.ny, c.nz) * weight);
    // like objects need not be alike
    point.at = point.root + 1000.0 * unit(hash3(uvec3(salt, sward.seed, 0x68bc21ebu)));
    point.facing = point.up;
    point.sward = swardOn(point.at, point.facing);
    density *= point.sward.density;
    if (!sprouts(random, density) || point.sward.height <= 0.0) return false;
    point.random = random;
    point.clump = clumpIn(point.at);
    point.rank = (float(j) + 0.5) / float(tile.candidates);
    point.perM2 = density * density_per_m2;
    point.lowDetail = point.onObject = true;
    blade = grown(point);
    return true;
}

void identify(Tile tile, uint j, uint at) {}  // their order is permanent

#include "sowing/each.glsl"
