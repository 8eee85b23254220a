// Runs grow() for every candidate of a tile, which workgroups share. Without PLACE it marks those that grow; with PLACE, after
// prefix_sum.comp counted them, it writes their blades in order, so that the same seed gives the same bytes,
// and identify() may note what it wrote where.

#ifdef PLACE
layout(std430) writeonly buffer Blades { Blade blades[]; };
layout(std430) writeonly buffer Heads { uint heads[]; };
#endif

uniform int first_tile;
#ifdef PLACE
uniform uint page;
#endif

void main() {
    uint slot = gl_WorkGroupID.x + uint(first_tile);
    Tile tile = tiles[slot];
    TileCount count = counts[slot];
#ifdef PLACE
    if (count.page != page) return;
#endif
    for (uint j = 64u * gl_WorkGroupID.y + gl_LocalInvocationID.x; j < tile.candidates; j += 64u * gl_NumWorkGroups.y) {
        uint word = count.first_word + (j >> 5u), bit = 1u << (j & 31u);
        Blade blade;
#ifdef PLACE
        Mark mark = marks[word];
        if ((mark.grows & bit) == 0u) continue;
        // the two programs may round differently: one that only the other grows is left without height
        if (!grow(tile, j, blade)) blade = Blade(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0u, 0, 0u, 0xffffu);
        uint at = count.start + mark.start + uint(bitCount(mark.grows & (bit - 1u)));
        blades[at] = blade;
        identify(tile, j, at);
        if ((mark.heads & bit) != 0u)
            heads[count.head_start + mark.head_start + uint(bitCount(mark.heads & (bit - 1u)))] = at;
#else
        if (!grow(tile, j, blade)) continue;
        atomicOr(marks[word].grows, bit);
        if (hasHead(blade)) atomicOr(marks[word].heads, bit);
#endif
    }
}
