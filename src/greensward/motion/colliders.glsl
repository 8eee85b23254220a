// Spheres and capsules that press blades down, listed by cells of a grid over x and z.
#include "motion/forces.glsl"
#include "layout/Colliders"
#include "layout/Ball"

#include "layout/Place"
#include "layout/CellEntry"

layout(std430) readonly buffer Balls { Ball balls[]; };    // in the own space of the objects that have this shape
layout(std430) readonly buffer Places { Place places[]; };  // of all objects at the first step of a dispatch, all at the next, …
// of each cell, where its entries begin and how many they are, and then the entries: an object and one of its balls
layout(std430) readonly buffer Cells { CellEntry cells[]; };

// From the axis of a ball to a point
vec3 fromAxis(uint ball, vec3 p) {
    vec3 a = balls[ball].end.xyz, axis = balls[ball].other_end.xyz - a;
    float t = clamp(dot(p - a, axis) / max(dot(axis, axis), 1e-12), 0.0, 1.0);
    return p - a - t * axis;
}

// Out of the ball, by how far a point inside it must move to its surface
vec3 outOf(uint ball, vec3 p) {
    vec3 from = fromAxis(ball, p);
    float away = length(from);
    return away > 1e-6 ? from * max(balls[ball].end.w / away - 1.0, 0.0) : vec3(0.0, balls[ball].end.w, 0.0);
}

// Jahrmann & Wimmer 2017: a tip inside moves to the nearest point of the surface; where the curve's middle,
// v0 / 4 + v1 / 2 + v2 / 4, is inside, the tip moves four times as far as the middle must. Collision strength grows by
// the square of the move, here in heights of the blade, so that small grass stays down like tall; in the natural form by
// the move itself, which does not depend on how finely time is cut.
bool collide(Blade b, int instant, vec3 root, vec3 control, inout vec3 tip, inout float pressed) {
#ifdef NO_COLLIDERS
    return false;
#endif
    ivec2 cell = ivec2(floor((root.xz - colliders.low) * colliders.cells_per_m));
    if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, ivec2(colliders.side)))) return false;
    CellEntry list = cells[cell.y * colliders.side + cell.x];
    bool touched = false;
    for (uint k = list.object; k < list.object + list.ball; k++) {
        uint ball = cells[k].ball;
        Place place = places[uint(instant * colliders.objects) + cells[k].object];
        mat3 turn = mat3(place.x.xyz, place.y.xyz, place.z.xyz);  // into the object's own space
        vec3 own = turn * (root - vec3(place.x.w, place.y.w, place.z.w));
        if (length(fromAxis(ball, own)) - balls[ball].end.w > b.height) continue;
        vec3 move = outOf(ball, own + turn * tip);
        vec3 middle = turn * (0.5 * control + 0.25 * tip) + 0.25 * move;
        move += 4.0 * outOf(ball, own + middle);
        if (dot(move, move) == 0.0) continue;
        move *= min(1.0, 2.0 * b.height / length(move));
        tip += move * turn;
        float far = length(move) / b.height;
        pressed = min(pressed + (FORM == NATURAL ? far : far * far), 1.0);
        touched = true;
    }
    return touched;
}
