// The one stored patch, drawn at many places: a blade of one of its instances, grown from the maps where it stands.
#include "sowing/ground_blade.glsl"
#include "culling/level_of_detail.glsl"
#include "techniques/tessellated_quads/variation.glsl"
#include "culling/tests.glsl"
#include "layout/PatternRoot"

layout(std430) readonly buffer Patch { PatternRoot stored[]; };
layout(std430) readonly buffer Places { ivec2 places[]; };  // of instances, in patches

uniform int first_place;
uniform int chunks_per_patch;  // of 32 blades
uniform int blades_per_patch;  // at this density
uniform int blades_stored;
uniform float patch_m;
uniform ivec2 anchor_patch;    // in which the anchor lies, and where in it
uniform vec2 in_patch;
uniform int variation;
uniform float tallest_m;
uniform float thinning;

vec2 placeOf(ivec2 place, PatternRoot s) { return (vec2(place - anchor_patch) + vec2(s.x, s.z) - in_patch) * patch_m; }

// False beyond the last of a patch
bool takeStored(out uint index, out ivec2 place, out PatternRoot s) {
    int chunk = gl_InstanceID % chunks_per_patch;
    index = uint(32 * chunk + gl_VertexID);
    if (index >= uint(blades_per_patch)) return false;
    place = places[first_place + gl_InstanceID / chunks_per_patch];
    s = stored[index];
    return true;
}

// Whether it may be needed as far away as it is at least, and may be in view: before anything is asked of the maps
bool mayShow(uint index, ivec2 place, PatternRoot s) {
    vec2 xz = placeOf(place, s);
    float near = max(distance(xz, view.camera_ws.xz) - 0.5 * sward.clump_m, 0.0), rank = (float(index) + 0.5) / float(blades_stored);
    if (near >= sward.blades_m || rank > view.density) return false;
#ifndef ALL_DISTANCES
    if (rank > lodCoverage(near, view.density)) return false;
#endif
    // as blade.tesc has it
    if (rank > (1.0 - thinning * min(near / sward.reach_m, 1.0)) * (1.0 + FADING)) return false;
    vec3 root = vec3(xz.x, groundHeight(xz), xz.y) - view.origin_ws.xyz;
    return !outside(root, root, root, 2.0 * tallest_m + sward.clump_m);
}

// Section 6.2: moved to its instance, hidden by the density map, raised by the height map
bool growStored(uint index, ivec2 place, PatternRoot s, out Blade b) {
    vec2 xz = placeOf(place, s);
    uvec3 bits;
    // to the same bits wherever it is counted from
    vec2 world = (vec2(place) + vec2(s.x, s.z)) * patch_m;
    for (int k = 0; k < 3; k++) {
        vec2 p = k == 1 ? world.yx : world;
        float random = varied(variation, s.random[2 * k] + 0.5 * s.random[2 * k + 1], p.x, p.y, ground.size_m[k & 1]);
        bits[k] = floatBitsToUint(random) ^ floatBitsToUint(s.random[2 * k + 1]);
    }
    Seed seed;
    seed.random = hash3(bits);
    seed.clump = pullIntoClump(xz, seed.random);
    seed.rank = (float(index) + 0.5) / float(blades_stored);
    seed.root = vec3(xz.x, groundHeight(xz), xz.y);
    return sprout(seed, b);
}
