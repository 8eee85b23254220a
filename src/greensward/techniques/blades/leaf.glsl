// A blade drawn as a leaf: how wide, towards which side, how finely cut.
#include "culling/bounds.glsl"
#include "layout/Leaf"

const float FADE = 0.15;  // of the cosine below `orientation_limit` over which a blade that is not turned loses its width

vec3 chordOf(BladeBounds h) { return normalize(h.v2 - h.v0); }

// The blade's own side, square to its chord
vec3 acrossOf(Blade b, vec3 chord) {
    vec3 front, across;
    bladeFrame(bladeUp(b), b.facing, front, across);
    return normalize(across - chord * dot(across, chord));
}

vec3 toViewerFrom(vec3 point) { return normalize(view.eye_rs.xyz - point * view.eye_rs.w); }

// Jahrmann & Wimmer 2017, section 5: seen edge-on where |view direction . side direction| is at least 0.9. Here the width
// reaches exactly 0 there, so that leaving out the blade changes nothing.
float edgeOnFade(float alignment, float limit) { return 1.0 - smoothstep(limit - FADE, limit, alignment); }

float coverageOf(Blade b, BladeBounds h) {
    float least = leaf.min_width_px * (view.camera_pixel_m.x * h.away + view.camera_pixel_m.y);
    float layers = occludingLayers(bladeCrowding(b), dot(view.camera_ws.xyz - bladeRoot(b), groundUnder(b)) / h.away, least);
    return min(wantedCoverage(layers, h.away), greatestCoverage(h.away, least));
}

float leafWidth(Blade b, BladeBounds h) {
    float least = leaf.min_width_px * h.pixel, widening = coverageOf(b, h) / max(lodArea(h.away, view.density), 1e-6);
#ifdef SHADOW
    float natural = b.width * widening;
    // a texel wide at least, but then fewer, or the shade of thin blades would grow
    if (bladeRandom(b) * least > natural) return -1.0;
    float wide = max(natural, least) * min(1.0, 2.0 * h.fade);
#else
    float wide = max(b.width, least) * widening * min(1.0, 2.0 * h.fade);
#endif
    if (leaf.orientation_limit > 1.0) return wide;
    float alignment = abs(dot(toViewerFrom(h.middle), acrossOf(b, chordOf(h))));
    return wide * edgeOnFade(alignment, leaf.orientation_limit);
}

// Segments that keep a quadratic curve within an error of its chords: |v0 - 2 v1 + v2| / (4 n^2) <= error.
// The outline tapers by half the width over the blade, and bends likewise where it is wide enough to tell.
float segments(vec3 v0, vec3 v1, vec3 v2, float width_m, float pixel, float shape) {
    float bend = length(v0 - 2.0 * v1 + v2) + 0.5 * max(width_m - 2.0 * pixel, 0.0);
    float n = ceil(sqrt(bend / (4.0 * leaf.error_px * pixel)));
    float least = shape > 5.5 ? 18.0 : 1.0;  // the lobes of a dandelion need them
    return clamp(n, least, max(least, leaf.max_level));
}

// The side as drawn: seen edge-on, turned into the plane of the screen, unless the blade is to vanish there
vec3 drawnSide(vec3 across, vec3 chord, vec3 toViewer) {
    if (leaf.orientation_limit <= 1.0) return across;
    vec3 screenSide = cross(chord, toViewer);
    float edgeOn = length(screenSide);
    screenSide = edgeOn > 1e-3 ? screenSide / edgeOn : across;
    if (dot(screenSide, across) < 0.0) screenSide = -screenSide;
    float facing = abs(dot(cross(across, chord), toViewer));
    return normalize(mix(screenSide, across, smoothstep(0.05, 0.4, facing)));
}
