// Permanent ids of blades of the ground by their numbers.
#include "sowing/leaf.glsl"
#include "layout/UnstoredTile"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Numbers { uint numbers[]; };  // within the page
layout(std430) writeonly buffer Found { uvec2 found[]; };
#ifdef UNSTORED
layout(std430) readonly buffer Tiles { UnstoredTile tiles[]; };
layout(std430) readonly buffer TileOf { uint tile_of[]; };  // of 32 candidates
#else
layout(std430) readonly buffer Ids { uvec2 ids[]; };
#endif

uniform int count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(count)) return;
    uint number = numbers[i];
#ifdef UNSTORED
    UnstoredTile t = tiles[tile_of[number >> 5u]];
    found[i] = idOf(Tile(t.x, t.z, t.level, 0u), number - t.first_candidate);
#else
    found[i] = ids[number];
#endif
}
