// Counts the marks of one tile per invocation: where each word's blades begin, and how many there are by rank.
#include "sowing/tiles.glsl"

layout(local_size_x = 64) in;

uniform int tileCount;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= uint(tileCount)) return;
    uint candidates = tiles[slot].candidates, firstWord = counts[slot].firstWord;
    uint blades = 0u, heads = 0u;
    for (uint word = 0u; word * 32u < candidates; word++) {
        Mark mark = marks[firstWord + word];
        marks[firstWord + word].start = blades;
        marks[firstWord + word].headStart = heads;
        blades += uint(bitCount(mark.grows));
        heads += uint(bitCount(mark.heads));
        // by eighths of the rank, rounded up to whole words
        counts[slot].upTo[min(7u, word * 256u / candidates)] = blades;
    }
    counts[slot].heads = heads;
}
