// A blade of the ground as a function of where it is tried: of the seed, the tile and its number there.
#include "sowing/grow.glsl"
#include "sowing/leaf.glsl"
#include "sowing/clump.glsl"

// Additive recurrence with the plastic number (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom
// Sequences"), shifted per leaf and jittered by the spacing of the points so far: even cover with no lattice to see.
vec2 placeIn(ivec2 leaf, uint index, uvec3 random) {
    uvec3 shift = hash3(uvec3(uvec2(leaf), sward.seed ^ 0x9e3779b9u));
    vec2 even = vec2((index * uvec2(3242174889u, 2447445414u) + shift.xy) >> 8u) * (1.0 / 16777216.0);
    vec2 jitter = (unit(random).xy - 0.5) * 1.4 * inversesqrt(float(index) + 1.0);
    return (vec2(leaf - sward.anchor_leaf) + fract(even + jitter)) * sward.leaf_m;
}

// What is known of a candidate before anything is asked of the sward
struct Seed { vec3 root; float rank; uvec3 random, clump; };

Seed seedOf(Tile tile, uint j) {
    ivec2 leaf;
    uint index;
    leafOf(tile, j, leaf, index);
    Seed s;
    s.random = hash3(uvec3(uvec2(leaf), index + sward.seed * 0x9e3779b9u));
    vec2 xz = placeIn(leaf, index, s.random);
    s.clump = pullIntoClump(xz, s.random);
    s.rank = (float(j) + 0.5) / (sward.density_per_m2 * sward.leaf_m * sward.leaf_m * exp2(2.0 * float(tile.level)));
    s.root = vec3(xz.x, groundHeight(xz), xz.y);
    return s;
}

// Level of detail: whether any camera this far away may need it
bool isNeeded(Seed seed, float away) { return seed.rank <= sownCoverage(away) && away <= sward.blades_m; }

// With the normal of the ground, as smooth or as flat as it is drawn
bool sproutOn(vec3 normal, Seed seed, out Blade blade) {
    vec2 xz = seed.root.xz;
    Sward s = swardAt(xz);
    float share = s.density * slopeShare(normal.y);
    if (!sprouts(seed.random, share) || s.height <= 0.0) return false;

    GrowthPoint point;
    point.root = seed.root;
    point.up = normalize(mix(vec3(0.0, 1.0, 0.0), normal, sward.along_normal));
    point.at = vec3(inWorld(xz), 0.0).xzy;
    point.facing = vec3(0.0, 1.0, 0.0);
    point.random = seed.random;
    point.clump = seed.clump;
    point.rank = seed.rank;
    point.perM2 = share * sward.density_per_m2;
    point.sward = s;
    point.lowDetail = textureLod(density_map, mapUv(xz), 0.0).g > 0.0;
    point.onObject = false;
    blade = grown(point);
    return true;
}

bool sprout(Seed seed, out Blade blade) { return sproutOn(groundNormal(seed.root.xz), seed, blade); }
