// A blade of the ground as a function of where it is tried: of the seed, the tile and its number there.
#include "sowing/grow.glsl"
#include "sowing/tile.glsl"

// Candidate j of a tile is blade j / 4^level of one of its 4^level leaves, visited in a scrambled order. So a prefix
// of any tile is a fair sample of it, and a blade is the same whichever level of tile it is sown from.
void leafOf(Tile tile, uint j, out ivec2 leaf, out uint index) {
    leaf = ivec2(tile.x, tile.z);
    for (int level = tile.level; level > 0; level--) {
        uint turn = hash3(uvec3(uvec2(leaf), uint(level) + (sward.seed << 5u))).x >> 30u;
        uint child = (j & 3u) ^ turn;
        leaf = 2 * leaf + ivec2(child & 1u, child >> 1u);
        j >>= 2u;
    }
    index = j;
}

// Additive recurrence with the plastic number (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom
// Sequences"), shifted per leaf and jittered by the spacing of the points so far: even cover with no lattice to see.
vec2 placeIn(ivec2 leaf, uint index, uvec3 random) {
    uvec3 shift = hash3(uvec3(uvec2(leaf), sward.seed ^ 0x9e3779b9u));
    vec2 even = vec2((index * uvec2(3242174889u, 2447445414u) + shift.xy) >> 8u) * (1.0 / 16777216.0);
    vec2 jitter = (unit(random).xy - 0.5) * 1.4 * inversesqrt(float(index) + 1.0);
    return (vec2(leaf) + fract(even + jitter)) * sward.leaf_m;
}

struct Clump { vec2 centre; uvec3 random; };

// Nearest of 3 x 3 jittered cells
Clump clumpAt(vec2 xz) {
    ivec2 cell = ivec2(floor(xz / sward.clump_m));
    Clump nearest;
    float best = 1e9;
    for (int dz = -1; dz <= 1; dz++) for (int dx = -1; dx <= 1; dx++) {
        uvec3 random = hash3(uvec3(uvec2(cell + ivec2(dx, dz)), sward.seed ^ 0x51ed270bu));
        vec2 centre = (vec2(cell + ivec2(dx, dz)) + unit(random).xy) * sward.clump_m;
        float d = distance(centre, xz);
        if (d < best) { best = d; nearest = Clump(centre, random); }
    }
    return nearest;
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
    Clump clump = clumpAt(xz);
    // no farther than blades reach over the gaps that this opens, or a lawn would look like mud that has dried
    float pull = 0.35 * sward.clumping * min(sward.blade_m.x / sward.clump_m, 1.0);
    xz = mix(xz, clump.centre, pull * unit(s.random.z));
    s.clump = clump.random;
    s.rank = (float(j) + 0.5) / (sward.density_per_m2 * sward.leaf_m * sward.leaf_m * exp2(2.0 * float(tile.level)));
    s.root = vec3(xz.x, groundHeight(xz), xz.y);
    return s;
}

// Whether any camera this far away may need it
bool isKept(Seed seed, float away) { return seed.rank <= keptShare(away) && away <= sward.blades_m; }

bool sprout(Seed seed, out Blade blade) {
    vec2 xz = seed.root.xz;
    Sward s = swardAt(xz);
    vec3 normal = groundNormal(xz);
    float share = s.density * slopeShare(normal.y);
    if (!sprouts(seed.random, share) || s.height <= 0.0) return false;

    Spot spot;
    spot.root = seed.root;
    spot.up = normalize(mix(vec3(0.0, 1.0, 0.0), normal, 0.35));
    spot.at = vec3(xz.x, 0.0, xz.y);
    spot.facing = vec3(0.0, 1.0, 0.0);
    spot.random = seed.random;
    spot.clump = seed.clump;
    spot.rank = seed.rank;
    spot.perM2 = share * sward.density_per_m2;
    spot.sward = s;
    spot.lowDetail = textureLod(densityMap, mapUv(xz), 0.0).g > 0.0;
    spot.onObject = false;
    blade = grown(spot);
    return true;
}
