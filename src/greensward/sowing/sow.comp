// Sows one tile of ground per workgroup.
#include "sowing/ground_blade.glsl"
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

uniform vec4 focus;   // xyz; w: how far the camera may move before the field is sown again

bool grow(Tile tile, uint j, out Blade blade) {
    Seed seed = seedOf(tile, j);
    return isNeeded(seed, distance(seed.root, focus.xyz) - focus.w) && sprout(seed, blade);
}

#include "sowing/each.glsl"
