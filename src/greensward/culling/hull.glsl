// A blade as a view may show it: the hull of its curve, and how much of it is there.
#include "culling/presence.glsl"
#include "shaders/bezier.glsl"

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) readonly buffer Postures { Posture postures[]; };

struct Hull {
    vec3 v0, v1, v2;  // control points of the curve as it is drawn
    vec3 middle;      // of the curve
    float away;       // from the camera, metres
    float here;       // presence, above 0
    float pixel;      // size of a pixel at the middle, metres
};

// False where the distance leaves the blade out
bool hullOf(uint index, out Blade b, out Hull h) {
    b = blades[index];
    h.v0 = bladeRoot(b);
    h.away = distance(h.v0, view.camera_ws.xyz);
    h.here = presence(b, h.away);
    if (h.here <= 0.0) return false;
    unpackPosture(postures[index].now, h.v0, h.v1, h.v2);
    h.v1 = mix(h.v0, h.v1, h.here);
    h.v2 = mix(h.v0, h.v2, h.here);
    h.middle = bezierPoint(h.v0, h.v1, h.v2, 0.5);
    float depth = dot(view.axis_ws.xyz, h.middle) + view.axis_ws.w;
    h.pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
    return true;
}
