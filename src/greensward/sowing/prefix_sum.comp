// Prefix sum of the marks of one tile per invocation: where each word's blades begin, and how many there are by rank.
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

uniform int tile_count;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= uint(tile_count)) return;
    uint candidates = tiles[slot].candidates, first_word = counts[slot].first_word;
    uint blades = 0u, heads = 0u;
    for (uint word = 0u; word * 32u < candidates; word++) {
        Mark mark = marks[first_word + word];
        marks[first_word + word].start = blades;
        marks[first_word + word].head_start = heads;
        blades += uint(bitCount(mark.grows));
        heads += uint(bitCount(mark.heads));
        // by eighths of the rank, rounded up to whole words
        counts[slot].up_to[min(7u, word * 256u / candidates)] = blades;
    }
    counts[slot].heads = heads;
}
