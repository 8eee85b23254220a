// Lists the balls that reach into each cell of the grid at any step, in order, one cell an invocation.
#include "block/Colliders"

layout(local_size_x = 64) in;

layout(std430, binding = 4) readonly buffer Reaches { vec4 reaches[]; };  // of each ball: low x and z, high x and z
layout(std430, binding = 5) writeonly buffer Cells { uint cells[]; };

void main() {
    uint cell = gl_GlobalInvocationID.x, side = uint(SIDE), words = uint(WORDS);
    if (cell >= side * side) return;
    vec2 low = colliders.low + vec2(cell % side, cell / side) / colliders.cells_per_m;
    vec2 high = low + 1.0 / colliders.cells_per_m;
    uint count = 0u;
    for (uint ball = 0u; ball < uint(colliders.count); ball++) {
        vec4 reach = reaches[ball];
        if (any(greaterThan(low, reach.zw)) || any(lessThan(high, reach.xy))) continue;
        if (count < words - 1u) cells[cell * words + 1u + count] = ball;
        count++;
    }
    cells[cell * words] = count < words ? count : 0xffffffffu;
}
