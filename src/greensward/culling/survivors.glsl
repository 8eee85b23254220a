// Which items of a word of 32 survived culling, and the index of each among all that did, in order.
layout(std430) readonly buffer Survivors { uint survivors[]; };
layout(std430) readonly buffer Offsets { uint offsets[]; };

bool survives(uint word, uint bit) { return (survivors[word] >> bit & 1u) != 0u; }

// Among so many words
uint compactedIndex(uint word, uint bit, uint items) {
    uint place = uint(bitCount(survivors[word] & ((1u << bit) - 1u))), level = 0u;
    while (true) {
        place += offsets[level + word];
        if (items <= 64u) return place;
        level += items;
        items = (items + 63u) / 64u;
        word /= 64u;
    }
    return place;
}
