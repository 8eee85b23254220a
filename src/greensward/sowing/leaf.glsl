// Leaves of the tiles of the ground, and the permanent id of a blade in one.
#include "shaders/hash.glsl"
#include "layout/Tile"
#include "layout/Sward"
#include "layout/BladeKind"

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

// As sowing/identity.py joins it: lower and upper word
uvec2 idOf(Tile tile, uint j) {
    ivec2 leaf;
    uint index;
    leafOf(tile, j, leaf, index);
    uvec2 place = uvec2(leaf) & 0x3fffffu;
    return uvec2(place.y << 16u | index, BLADE_KIND_GROUND << 28u | place.x << 6u | place.y >> 16u);
}
