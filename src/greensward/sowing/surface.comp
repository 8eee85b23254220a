// Sows one group of an object's triangles per workgroup, in the object's own space. Of its tile, x is the first
// triangle and z how many there are.
#include "sowing/grow.glsl"
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

struct Corner { float x, y, z, density; float nx, ny, nz; float u, v; };
struct Triangle { uint a, b, c; float end; };  // end: part of the tile's area up to and with this triangle

layout(std430, binding = 5) readonly buffer Corners { Corner corners[]; };
layout(std430, binding = 6) readonly buffer Triangles { Triangle triangles[]; };
layout(binding = 5) uniform sampler2D furMap;

uniform uint salt;  // differs from object to object
uniform float densityPerM2;

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

// Nearest of 3 x 3 x 3 jittered cells
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
    Triangle t = triangles[index];
    float start = index > uint(tile.x) ? triangles[index - 1u].end : 0.0, share = max(t.end - start, 1e-9);
    vec2 jitter = (unit(random).xy - 0.5) * 1.4 * inversesqrt(float(j) * share + 1.0);
    vec2 place = fract(vec2(clamp((even.x - start) / share, 0.0, 1.0), even.y) + jitter);
    float across = sqrt(place.x);
    vec3 weight = vec3(1.0 - across, across * (1.0 - place.y), across * place.y);

    Corner a = corners[t.a], b = corners[t.b], c = corners[t.c];
    vec2 uv = mat3x2(a.u, a.v, b.u, b.v, c.u, c.v) * weight;
    float density = dot(vec3(a.density, b.density, c.density), weight) * textureLod(furMap, vec2(uv.x, 1.0 - uv.y), 0.0).r;
    Spot spot;
    spot.root = mat3(a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z) * weight;
    spot.up = normalize(mat3(a.nx, a.ny, a.nz, b.nx, b.ny, b.nz, c.nx, c.ny, c.nz) * weight);
    // like objects need not be alike
    spot.at = spot.root + 1000.0 * unit(hash3(uvec3(salt, sward.seed, 0x68bc21ebu)));
    spot.facing = spot.up;
    spot.sward = swardOn(spot.at, spot.facing);
    density *= spot.sward.density;
    if (!sprouts(random, density) || spot.sward.height <= 0.0) return false;
    spot.random = random;
    spot.clump = clumpIn(spot.at);
    spot.rank = (float(j) + 0.5) / float(tile.candidates);
    spot.perM2 = density * densityPerM2;
    spot.lowDetail = spot.onObject = true;
    blade = grown(spot);
    return true;
}

#include "sowing/each.glsl"
