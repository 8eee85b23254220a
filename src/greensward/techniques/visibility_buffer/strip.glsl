// A leaf on the screen: a strip of planar quads along its curve. The curve, its side and what is linear along both stay so
// in clip space, so three points and a direction are all that is transformed.
#include "techniques/blades/leaf.glsl"
#include "techniques/blades/outlines.glsl"

struct Strip {
    vec4 c0, c1, c2;  // control points of the curve
    vec4 side;        // from the left to the right edge of a quad
    vec3 side_ws;     // unit
    float width;      // metres
    int shape, segments;
};

Strip stripOf(Blade b, BladeBounds h, float wide) {
    vec3 chord = chordOf(h), across = acrossOf(b, chord);
    float kind = species(bladeSpecies(b), MIX).z;
    Strip s;
    s.side_ws = drawnSide(across, chord, toViewerFrom(h.middle));
    s.c0 = view.jittered_clip_from_relative * vec4(h.v0, 1.0);
    s.c1 = view.jittered_clip_from_relative * vec4(h.v1, 1.0);
    s.c2 = view.jittered_clip_from_relative * vec4(h.v2, 1.0);
    s.side = view.jittered_clip_from_relative * vec4(wide * s.side_ws, 0.0);
    s.width = wide;
    s.shape = int(kind);
    s.segments = int(min(segments(h.v0, h.v1, h.v2, wide, h.pixel, kind), 32.0));
    return s;
}

vec4 centreAt(Strip s, float v) { return mix(mix(s.c0, s.c1, v), mix(s.c1, s.c2, v), v); }

// Of the edges at v, from the middle, in widths
vec2 edgesAt(Strip s, float v, float depth) {
    float widthPx = s.width / (view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y);
    return vec2(shapeParameter(s.shape, 0.0, v, widthPx), shapeParameter(s.shape, 1.0, v, widthPx)) - 0.5;
}

// What the fold lifts the middle by, in clip space
vec4 foldAt(Strip s, BladeBounds h, float v) {
    vec3 outward = cross(s.side_ws, normalize(bezierTangent(h.v0, h.v1, h.v2, v)));
    return view.jittered_clip_from_relative * vec4(s.width * shapeFold(s.shape, 0.5, v) * outward, 0.0);
}

// One quad is too far away to show its fold
bool isFolded(Strip s) { return s.shape == QUADRATIC_3D && s.segments > 1; }
