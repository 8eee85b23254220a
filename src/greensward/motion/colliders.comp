// Lists the balls that reach into each cell of the grid at any step, in order, one cell an invocation.
#include "block/Colliders"

layout(local_size_x = 64) in;

layout(std430, binding = 4) readonly buffer Balls { vec4 balls[]; };
layout(std430, binding = 5) writeonly buffer Cells { uint cells[]; };

const uint SIDE = 64u, WORDS = 32u;

void main() {
    uint cell = gl_GlobalInvocationID.x;
    if (cell >= SIDE * SIDE) return;
    vec2 low = colliders.low + vec2(cell % SIDE, cell / SIDE) / colliders.cells_per_m;
    vec2 high = low + 1.0 / colliders.cells_per_m;
    uint count = 0u;
    for (uint ball = 0u; ball < uint(colliders.count); ball++) {
        bool reaches = false;
        for (uint at = ball; at < uint(colliders.count * colliders.instants); at += uint(colliders.count)) {
            vec4 a = balls[2u * at], b = balls[2u * at + 1u];
            float reach = a.w + colliders.tallest_m;
            reaches = reaches || (all(lessThanEqual(low, max(a.xz, b.xz) + reach))
                                  && all(greaterThanEqual(high, min(a.xz, b.xz) - reach)));
        }
        if (!reaches) continue;
        if (count < WORDS - 1u) cells[cell * WORDS + 1u + count] = ball;
        count++;
    }
    cells[cell * WORDS] = count < WORDS ? count : 0xffffffffu;
}
