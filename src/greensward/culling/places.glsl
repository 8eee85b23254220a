// Which blades of a chunk were kept, and the place of each among all that were: in the order of the chunks.
layout(std430, binding = 9) readonly buffer Kept { uint kept[]; };
layout(std430, binding = 10) readonly buffer Starts { uint starts[]; };

uniform int chunkCount;

bool isKept(uint chunk, uint lane) { return (kept[chunk] >> lane & 1u) != 0u; }

uint placeOf(uint chunk, uint lane) {
    uint place = uint(bitCount(kept[chunk] & ((1u << lane) - 1u))), level = 0u, items = uint(chunkCount);
    while (true) {
        place += starts[level + chunk];
        if (items <= 64u) return place;
        level += items;
        items = (items + 63u) / 64u;
        chunk /= 64u;
    }
    return place;
}
