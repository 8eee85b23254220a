// Sows one tile of ground per workgroup.
#include "sowing/ground_blade.glsl"
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

bool grow(Tile tile, uint j, out Blade blade) { return sprout(seedOf(tile, j), blade); }

#include "sowing/each.glsl"
