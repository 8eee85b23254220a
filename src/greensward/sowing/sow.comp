// Sows one tile per workgroup. Without PLACE it marks the candidates that grow; with PLACE, after tally.comp counted
// them, it writes their blades in order, so that the same seed gives the same bytes.
#include "sowing/sward.glsl"
#include "sowing/tiles.glsl"
#include "shaders/blade.glsl"
#include "shaders/bezier.glsl"

layout(local_size_x = 64) in;

#ifdef PLACE
layout(std430, binding = 3) writeonly buffer Blades { Blade blades[]; };
layout(std430, binding = 4) writeonly buffer Heads { uint heads[]; };
#endif

uniform vec4 focus;   // xyz; w: how far the camera may move before the field is sown again
uniform int firstTile;

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

int pickSpecies(vec2 xz, float chance) {
    float total = 0.0;
    for (int i = 0; i < sward.count; i++) total += speciesWeight(i, xz);
    chance *= total;
    for (int i = 0; i < sward.count - 1; i++) {
        chance -= speciesWeight(i, xz);
        if (chance < 0.0) return i;
    }
    return sward.count - 1;
}

float range(vec2 ends, float t) { return mix(ends.x, ends.y, t); }

bool grow(Tile tile, uint j, out Blade blade) {
    ivec2 leaf;
    uint index;
    leafOf(tile, j, leaf, index);
    uvec3 random = hash3(uvec3(uvec2(leaf), index + sward.seed * 0x9e3779b9u));
    vec2 xz = placeIn(leaf, index, random);
    Clump clump = clumpAt(xz);
    xz = mix(xz, clump.centre, 0.35 * sward.clumping * unit(random.z));

    float rank = (float(j) + 0.5) / (sward.density_per_m2 * sward.leaf_m * sward.leaf_m * exp2(2.0 * float(tile.level)));
    vec3 root = vec3(xz.x, groundHeight(xz), xz.y);
    float away = distance(root, focus.xyz) - focus.w;
    if (rank > keptShare(away) || away > sward.reach_m) return false;
    Sward s = swardAt(xz);
    vec3 normal = groundNormal(xz);
    uvec3 own = hash3(random ^ 0xa511e9b3u), more = hash3(random ^ 0x63d83595u);
    if (unit(own.x) >= s.density * slopeShare(normal.y) || s.height <= 0.0) return false;

    int kind = pickSpecies(xz, unit(own.y));
    vec4 size = species(kind, SIZE), posture = species(kind, POSTURE), habit = species(kind, HABIT);
    float together = sward.clumping;
    vec3 shared3 = unit(hash3(clump.random));
    vec3 alone = unit(more);
    uvec3 last = hash3(random ^ 0x1b56c4e9u);
    vec3 spare = unit(last);

    vec3 up = normalize(mix(vec3(0.0, 1.0, 0.0), normal, 0.35));
    float facing = 6.28318531 * (shared3.x + mix(1.0, 0.22, together) * (alone.x - 0.5));
    vec3 front, side;
    bladeFrame(up, facing, front, side);
    float tall = clamp(mix(alone.y, 0.6 * alone.y + 0.4 * shared3.y, together), 0.0, 1.0);
    float height = max(range(size.xy, tall) * s.height, 1e-3);
    float tilt = range(posture.zw, clamp(mix(alone.z, 0.65 * alone.z + 0.35 * shared3.z, together), 0.0, 1.0));
    float arch = range(habit.xy, spare.x);

    vec3 v1, v2;
    vec3 lean = cos(tilt) * up + sin(tilt) * front;
    vec3 across = sin(tilt) * up - cos(tilt) * front;
    v2 = root + height * lean;
    v1 = root + height * (0.5 * lean + 0.5 * arch * across);
    keepLength(root, v1, v2, height);

    float dry = clamp(range(habit.zw, clamp(s.dryness + 0.35 * (spare.y - 0.5) + 0.25 * together * (shared3.y - 0.5), 0.0, 1.0)), 0.0, 1.0);
    bool head = unit(hash3(last).x) < species(kind, DRY).w;
    bool lowDetail = textureLod(densityMap, mapUv(xz), 0.0).g > 0.0;
    float tint = clamp(mix(spare.z, 0.5 * spare.z + 0.5 * shared3.z, together), 0.0, 1.0);

    blade.x = root.x; blade.y = root.y; blade.z = root.z;
    blade.facing = facing;
    blade.x1 = v1.x; blade.y1 = v1.y; blade.z1 = v1.z;
    blade.height = height;
    blade.x2 = v2.x; blade.y2 = v2.y; blade.z2 = v2.z;
    blade.width = range(size.zw, 0.5 * tall + 0.5 * unit(last.y));
    blade.up = packSnorm2x16(octahedralEncode(up));
    blade.stiffness = range(posture.xy, unit(own.z));
    blade.look = uint(kind) | (head ? 16u : 0u) | (lowDetail ? 32u : 0u)
        | uint(dry * 255.0 + 0.5) << 8u | uint(tint * 255.0 + 0.5) << 16u;
    blade.chance = packUnorm2x16(vec2(sqrt(rank), unit(hash3(last).y)));
    return true;
}

void main() {
    uint slot = gl_WorkGroupID.x + uint(firstTile);
    Tile tile = tiles[slot];
    Count count = counts[slot];
    for (uint j = gl_LocalInvocationID.x; j < tile.candidates; j += 64u) {
        uint word = count.firstWord + (j >> 5u), bit = 1u << (j & 31u);
        Blade blade;
#ifdef PLACE
        Mark mark = marks[word];
        if ((mark.grows & bit) == 0u) continue;
        // the two programs may round differently: one that only the other grows is left without height
        if (!grow(tile, j, blade)) blade = Blade(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0u, 0, 0u, 0xffffu);
        uint at = count.start + mark.start + uint(bitCount(mark.grows & (bit - 1u)));
        blades[at] = blade;
        if ((mark.heads & bit) != 0u)
            heads[count.headStart + mark.headStart + uint(bitCount(mark.heads & (bit - 1u)))] = at;
#else
        if (!grow(tile, j, blade)) continue;
        atomicOr(marks[word].grows, bit);
        if ((blade.look & 16u) != 0u) atomicOr(marks[word].heads, bit);
#endif
    }
}
