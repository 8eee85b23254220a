// Tiles being sown, what is counted of each, and a mark for each of their candidates. Marks are bits set by atomics and
// counted in order: no invocation waits for another, which drivers get wrong where threads diverge.
#include "layout/Tile"
#include "layout/TileCount"
#include "layout/Mark"

layout(std430) readonly buffer Tiles { Tile tiles[]; };
layout(std430) buffer Counts { TileCount counts[]; };
layout(std430) buffer Marks { Mark marks[]; };
