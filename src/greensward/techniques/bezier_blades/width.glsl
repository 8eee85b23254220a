// How wide a blade is drawn; both the tests of culling and what prepares the drawing ask for it.
#include "culling/hull.glsl"
#include "block/BezierBlades"

const float FADE = 0.15;  // of the cosine below `orientation_limit` over which a blade that is not turned loses its width

vec3 chordOf(Hull h) { return normalize(h.v2 - h.v0); }

// The blade's own side, square to its chord
vec3 acrossOf(Blade b, vec3 chord) {
    vec3 front, across;
    bladeFrame(bladeUp(b), b.facing, front, across);
    return normalize(across - chord * dot(across, chord));
}

vec3 toViewerFrom(vec3 point) { return normalize(view.eye_ws.xyz - point * view.eye_ws.w); }

// Jahrmann & Wimmer 2017, section 5: seen edge-on where |view direction . side direction| is at least 0.9. Here the width
// reaches exactly 0 there, so that leaving out the blade changes nothing.
float shareOfWidth(float alignment, float limit) { return 1.0 - smoothstep(limit - FADE, limit, alignment); }

float widthOf(Blade b, Hull h) {
    float natural = b.width * h.widening, least = bezierblades.min_width_px * h.pixel;
#ifdef SHADOW
    // a texel wide at least, but then fewer, or the shade of thin blades would grow
    if (bladeRandom(b) * least > natural) return -1.0;
#endif
    float wide = max(natural, least) * min(1.0, 2.0 * h.here);
    if (bezierblades.orientation_limit > 1.0) return wide;
    float alignment = abs(dot(toViewerFrom(h.middle), acrossOf(b, chordOf(h))));
    return wide * shareOfWidth(alignment, bezierblades.orientation_limit);
}
