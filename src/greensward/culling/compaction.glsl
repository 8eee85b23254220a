// Stream compaction: which blades of a chunk survived culling, and the index of each among all that did, in order.
#include "culling/chunk_items.glsl"

layout(std430) readonly buffer Survivors { uint survivors[]; };
layout(std430) readonly buffer Offsets { uint offsets[]; };

bool survives(uint chunk, uint lane) { return (survivors[chunk] >> lane & 1u) != 0u; }

uint compactedIndex(uint chunk, uint lane) {
    uint place = uint(bitCount(survivors[chunk] & ((1u << lane) - 1u))), level = 0u, items = uint(chunk_count);
    while (true) {
        place += offsets[level + chunk];
        if (items <= 64u) return place;
        level += items;
        items = (items + 63u) / 64u;
        chunk /= 64u;
    }
    return place;
}
