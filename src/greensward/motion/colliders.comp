// Lists the balls that reach into each cell of the grid at any step, in order, one cell an invocation. With REACH writes what
// the balls of each object reach, one object an invocation.
#include "layout/Colliders"
#include "layout/Ball"
#include "layout/Place"
#include "layout/Solid"
#include "layout/Reach"
#include "layout/CellHead"
#include "layout/CellEntry"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Solids { Solid solids[]; };
#ifdef REACH
layout(std430) readonly buffer Balls { Ball balls[]; };
layout(std430) readonly buffer Places { Place places[]; };
layout(std430) writeonly buffer Reaches { Reach reaches[]; };  // of the balls of each object

vec2 placed(uint place, vec3 p) {
    vec4 own = vec4(p, 1.0);
    return vec2(dot(places[place].x, own), dot(places[place].z, own));
}

void main() {
    uint object = gl_GlobalInvocationID.x;
    if (object >= uint(colliders.objects)) return;
    Solid solid = solids[object];
    for (uint k = 0u; k < solid.count; k++) {
        Ball ball = balls[solid.first + k];
        vec2 low = vec2(1e30), high = vec2(-1e30);
        for (int instant = 0; instant < colliders.instants; instant++) {
            uint place = uint(instant * colliders.objects) + object;
            vec2 a = placed(place, ball.end.xyz), b = placed(place, ball.other_end.xyz);
            low = min(low, min(a, b));
            high = max(high, max(a, b));
        }
        float around = ball.end.w + colliders.margin_m;
        reaches[solid.reach + k] = Reach(low - around, high + around);
    }
}
#else
layout(std430) readonly buffer Reaches { Reach reaches[]; };
layout(std430) readonly buffer Heads { CellHead heads[]; };  // the last ends the objects of the one before
layout(std430) readonly buffer Near { uint near[]; };
layout(std430) writeonly buffer Cells { CellEntry cells[]; };

void main() {
    uint cell = gl_GlobalInvocationID.x, side = uint(colliders.side);
    if (cell >= side * side) return;
    vec2 low = colliders.low + vec2(cell % side, cell / side) / colliders.cells_per_m;
    vec2 high = low + 1.0 / colliders.cells_per_m;
    uint first = side * side + heads[cell].entry, count = 0u;
    for (uint i = heads[cell].first; i < heads[cell + 1u].first; i++) {
        Solid solid = solids[near[i]];
        for (uint k = 0u; k < solid.count; k++) {
            Reach reach = reaches[solid.reach + k];
            if (any(greaterThan(low, reach.high)) || any(lessThan(high, reach.low))) continue;
            cells[first + count++] = CellEntry(near[i], solid.first + k);
        }
    }
    cells[cell] = CellEntry(first, count);
}
#endif
