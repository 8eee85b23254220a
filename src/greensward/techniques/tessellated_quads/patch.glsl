// The one stored patch, drawn at many places: a blade of one of its instances, grown from the maps where it stands.
#include "sowing/ground_blade.glsl"
#include "culling/level_of_detail.glsl"
#include "techniques/tessellated_quads/variation.glsl"
#include "techniques/tessellated_quads/parameters.glsl"
#include "techniques/tessellated_quads/thinning.glsl"
#include "culling/tests.glsl"
#include "layout/PatternRoot"

layout(std430) readonly buffer Patch { PatternRoot stored[]; };
layout(std430) readonly buffer Places { ivec2 places[]; };  // of instances, in patches

uniform int first_place;
uniform int chunks_per_patch;  // of 32 blades
uniform int blades_per_patch;  // at this density
uniform int blades_stored;
uniform int variation;
uniform float tallest_m;

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
    if (rank > partOfBlades(near) * (1.0 + FADING)) return false;
    vec3 root = vec3(xz.x, groundHeight(xz), xz.y) - view.origin_ws.xyz;
    return !outside(root, root, root, 2.0 * tallest_m + sward.clump_m);
}

// Its eight random values, varied by where it stands
float[8] variedRandoms(uint index, ivec2 place, PatternRoot s) {
    float random[8];
    // to the same bits wherever it is counted from
    vec2 world = (vec2(place) + vec2(s.x, s.z)) * patch_m, share = mapUv(placeOf(place, s));
    for (int k = 0; k < 8; k++) {
        int axis = k & 1;
        if (variation == HASH)
            random[k] = fract(s.random[k] + unit(hash3(uvec3(uvec2(place), index * 8u + uint(k)))).x);
        else
            random[k] = varied(variation, s.random[k], world[axis], world[1 - axis], share[axis]);
    }
    return random;
}

// Section 6.2: moved to its instance, hidden by the density map, raised by the height map
bool growStored(uint index, ivec2 place, PatternRoot s, float random[8], out Blade b) {
    vec2 xz = placeOf(place, s);
    uvec3 bits = uvec3(0u);
    for (int k = 0; k < 8; k++) bits[k % 3] = bits[k % 3] * 31u + floatBitsToUint(random[k]);
    Seed seed;
    seed.random = hash3(bits);
    seed.clump = pullIntoClump(xz, seed.random);
    seed.rank = (float(index) + 0.5) / float(blades_stored);
    seed.root = vec3(xz.x, groundHeight(xz), xz.y);
    return sprout(seed, b);
}
