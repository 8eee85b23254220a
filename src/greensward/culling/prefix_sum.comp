// Prefix sum: where the survivors of each chunk begin. Sums of 64 at a time, level upon level, until one is left, their number.
// Each invocation has 64 items to itself, so that the order is always the same and nothing waits.
#include "layout/DrawCommand"

layout(local_size_x = 64) in;

layout(std430) buffer Masks { uint masks[]; };
layout(std430) writeonly buffer Survivors { uint survivors[]; };
layout(std430) buffer Offsets { uint offsets[]; };
layout(std430) writeonly buffer Commands { DrawCommand commands[]; };

const int FAN = 64;

uniform int items;      // of this level
uniform int start;      // of this level in the table; 0 is that of the chunks
uniform int command;

uint take(int i) {
    if (start > 0) return offsets[start + i];
    uint mask = masks[i];
    masks[i] = 0u;  // as the next run of chunks wants it
    survivors[i] = mask;
    return uint(bitCount(mask));
}

void main() {
    int block = int(gl_GlobalInvocationID.x), first = block * FAN;
    if (first >= items) return;
    // all are read before any is written: no reading waits for a writing
    uint counts[FAN];
    for (int i = 0; i < FAN; i++) counts[i] = first + i < items ? take(first + i) : 0u;
    uint sum = 0u;
    for (int i = 0; i < FAN; i++) {
        if (first + i < items) offsets[start + first + i] = sum;
        sum += counts[i];
    }
    if (items > FAN) {
        offsets[start + items + block] = sum;
        return;
    }
    commands[command] = DrawCommand(32u, (sum + 31u) / 32u, 0u, 0u, sum);
}
