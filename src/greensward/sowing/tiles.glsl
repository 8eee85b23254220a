// Tiles being sown, what is counted of each, and a mark for each of their candidates. Marks are bits set by atomics and
// counted in order: no invocation waits for another, which drivers get wrong where threads diverge.
#include "sowing/tile.glsl"

struct Count { uint upTo[8]; uint heads; uint start; uint headStart; uint firstWord; };
struct Mark { uint grows; uint heads; uint start; uint headStart; };  // of 32 candidates; starts within the tile

layout(std430, binding = 0) readonly buffer Tiles { Tile tiles[]; };
layout(std430, binding = 1) buffer Counts { Count counts[]; };
layout(std430, binding = 2) buffer Marks { Mark marks[]; };
