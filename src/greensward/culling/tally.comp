// Where the survivors of each chunk begin: sums of 64 at a time, level upon level, until one is left, which is their number.
// Each invocation has 64 items to itself, so that the order is always the same and nothing waits.
layout(local_size_x = 64) in;

layout(std430, binding = 8) buffer Masks { uint masks[]; };
layout(std430, binding = 9) writeonly buffer Kept { uint kept[]; };
layout(std430, binding = 10) buffer Starts { uint starts[]; };
layout(std430, binding = 11) writeonly buffer Commands { uint commands[]; };

const int FAN = 64;

uniform int items;      // of this level
uniform int start;      // of this level in the table; 0 is that of the chunks
uniform int command;    // 20 bytes each

uint take(int i) {
    if (start > 0) return starts[start + i];
    uint mask = masks[i];
    masks[i] = 0u;  // as the next run of chunks wants it
    kept[i] = mask;
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
        if (first + i < items) starts[start + first + i] = sum;
        sum += counts[i];
    }
    if (items > FAN) {
        starts[start + items + block] = sum;
        return;
    }
    // vertices, instances, first vertex, first instance; the last word is ours
    commands[5 * command] = 32u;
    commands[5 * command + 1] = (sum + 31u) / 32u;
    commands[5 * command + 2] = 0u;
    commands[5 * command + 3] = 0u;
    commands[5 * command + 4] = sum;
}
