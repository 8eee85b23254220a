// Clumps: cells of Worley noise whose centres pull the roots around them.
#include "shaders/hash.glsl"
#include "layout/Sward"

struct Clump { vec2 centre; uvec3 random; };

// Worley 1996, "A Cellular Texture Basis Function": the nearest of 3 x 3 jittered cells
Clump clumpAt(vec2 xz) {
    ivec2 cell = ivec2(floor(xz / sward.clump_m + sward.in_clump));
    Clump nearest;
    float best = 1e9;
    for (int dz = -1; dz <= 1; dz++) for (int dx = -1; dx <= 1; dx++) {
        uvec3 random = hash3(uvec3(uvec2(cell + ivec2(dx, dz) + sward.anchor_clump), sward.seed ^ 0x51ed270bu));
        vec2 centre = (vec2(cell + ivec2(dx, dz)) + unit(random).xy - sward.in_clump) * sward.clump_m;
        float d = distance(centre, xz);
        if (d < best) { best = d; nearest = Clump(centre, random); }
    }
    return nearest;
}

// Pulls a root towards the centre of its clump and returns the clump's random numbers: no farther than blades reach over the
// gaps that this opens, or a lawn would look like mud that has dried.
uvec3 pullIntoClump(inout vec2 xz, uvec3 random) {
    Clump clump = clumpAt(xz);
    float pull = 0.35 * sward.clumping * min(sward.blade_m.x / sward.clump_m, 1.0);
    xz = mix(xz, clump.centre, pull * unit(random.z));
    return clump.random;
}
