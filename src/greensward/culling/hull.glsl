// A blade as a view may show it: the hull of its curve, and how much of it is there. Points are in relative space.
#include "culling/presence.glsl"
#include "culling/tests.glsl"
#include "shaders/bezier.glsl"
#include "culling/blades.glsl"

struct Hull {
    vec3 v0, v1, v2;  // control points of the curve as it is drawn
    vec3 middle;      // of the curve
    float away;       // from the camera, metres
    float here;       // presence, above 0
    float pixel;      // size of a pixel at the middle, metres
};

// Where it stands and how much of it is there; false where that is nothing
bool isThere(Blade b, out Hull h) {
    h.v0 = bladeRoot(b) - view.origin_ws.xyz;
    h.away = distance(bladeRoot(b), view.camera_ws.xyz);
    h.here = presence(b, h.away);
    return h.here > 0.0;
}

// From its full-grown control points to those of what is there
void drawIn(inout Hull h) {
    h.v1 = mix(h.v0, h.v1, h.here);
    h.v2 = mix(h.v0, h.v2, h.here);
    h.middle = bezierPoint(h.v0, h.v1, h.v2, 0.5);
    float depth = dot(view.axis_rs.xyz, h.middle) + view.axis_rs.w;
    h.pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
}

// False where none grows, or the distance leaves it out
bool hullOf(uint index, out Blade b, out Hull h) {
    if (!fetchBlade(index, b) || !isThere(b, h)) return false;
    postureNow(index, b, h.v0, h.v1, h.v2);
    drawIn(h);
    return true;
}
