// Lists the balls that reach into each cell of the grid at any step, in order, one cell an invocation.
#include "layout/Colliders"
#include "layout/Reach"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Reaches { Reach reaches[]; };  // of each ball
layout(std430) writeonly buffer Cells { uint cells[]; };

void main() {
    uint cell = gl_GlobalInvocationID.x, side = uint(SIDE), words = uint(WORDS);
    if (cell >= side * side) return;
    vec2 low = colliders.low + vec2(cell % side, cell / side) / colliders.cells_per_m;
    vec2 high = low + 1.0 / colliders.cells_per_m;
    uint count = 0u;
    for (uint ball = 0u; ball < uint(colliders.count); ball++) {
        Reach reach = reaches[ball];
        if (any(greaterThan(low, reach.high)) || any(lessThan(high, reach.low))) continue;
        if (count < words - 1u) cells[cell * words + 1u + count] = ball;
        count++;
    }
    cells[cell * words] = count < words ? count : 0xffffffffu;
}
