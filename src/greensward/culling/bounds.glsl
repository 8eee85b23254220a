// Bounds of a blade as a view may show it: the hull of its curve, and its fade by level of detail. Points are in relative space.
#include "culling/level_of_detail.glsl"
#include "shaders/bezier.glsl"
#include "shaders/blade.glsl"

struct BladeBounds {
    vec3 v0, v1, v2;  // control points of the curve as it is drawn
    vec3 middle;      // of the curve
    float away;       // from the camera, metres
    float fade;       // of level of detail, above 0
    float pixel;      // size of a pixel at the middle, metres
};

// Root, distance and fade; false where the level of detail leaves the blade out
bool startBounds(Blade b, out BladeBounds h) {
    h.v0 = bladeRoot(b) - view.origin_ws.xyz;
    h.away = distance(bladeRoot(b), view.camera_ws.xyz);
    h.fade = lodFade(b, h.away);
    return h.fade > 0.0;
}

// Draws the control points in by the fade
void shrinkByFade(inout BladeBounds h) {
    h.v1 = mix(h.v0, h.v1, h.fade);
    h.v2 = mix(h.v0, h.v2, h.fade);
    h.middle = bezierPoint(h.v0, h.v1, h.v2, 0.5);
    float depth = dot(view.axis_rs.xyz, h.middle) + view.axis_rs.w;
    h.pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
}
