// Sows tiles of the ground.
#include "sowing/ground_blade.glsl"
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

bool grow(Tile tile, uint j, out Blade blade) { return sprout(seedOf(tile, j), blade); }

#ifdef PLACE
layout(std430) writeonly buffer Ids { uvec2 ids[]; };

void identify(Tile tile, uint j, uint at) { ids[at] = idOf(tile, j); }
#endif

#include "sowing/each.glsl"
