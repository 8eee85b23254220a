// Software rasteriser of blades, one an invocation; those that are large on the screen are left to large.comp.
#include "culling/visibility.glsl"
#include "culling/chunk_items.glsl"
#include "techniques/visibility_buffer/strip.glsl"
#include "techniques/visibility_buffer/fill.glsl"
#include "techniques/visibility_buffer/lists.glsl"

layout(local_size_x = 32) in;

#ifndef SHADOW
uniform uint first_primitive_id;
uniform float near_m;
#endif

uniform float large_px;

bool isLarge(Strip s) {
#ifndef SHADOW
    if (min(min(s.c0.w, s.c1.w), s.c2.w) - s.width < max(near_m, 0.2)) return true;  // perhaps before the near plane
#endif
    vec2 half_px = 0.5 * view.size_px.xy, a = s.c0.xy / s.c0.w, b = s.c1.xy / s.c1.w, c = s.c2.xy / s.c2.w;
    vec2 size = (max(max(a, b), c) - min(min(a, b), c)) * half_px;
    vec2 side = abs(s.side.xy) / min(min(s.c0.w, s.c1.w), s.c2.w) * half_px;
    // rows, each as wide as a part of the blade
    return (size.y + side.y + 1.0) * (side.x + 2.0) + size.x > large_px;
}

// Which blade of the page is this invocation's
bool take(out uint index) {
#ifdef TWO_PASSES
    if (writing_ids) {
        uint item = 32u * workgroupIndex() + gl_LocalInvocationID.x;
        if (item >= lists.listed[WON]) return false;
        index = deferredBlade(WON, item);
        return true;
    }
#endif
    return takeItem(index);
}

void main() {
    uint index, primitive_id = 0u;
    if (!take(index)) return;
    Blade b;
    BladeBounds h;
    float wide;
    if (!isVisible(index, b, h, wide)) return;
    Strip s = stripOf(b, h, wide);
#ifndef SHADOW
    primitive_id = first_primitive_id + 32u * index;
#ifdef TWO_PASSES
    if (!writing_ids)
#endif
    countDrawn(gl_WorkGroupID.x);
    if (max(max(s.c0.w, s.c1.w), s.c2.w) + s.width < near_m) return;  // behind the viewer
#endif
    if (isLarge(s)) {
        if (!outside(h.v0, h.v1, h.v2, wide)) defer(LARGE, index);
        return;
    }
    bool shown = false;
    vec4 centre = s.c0, lift = vec4(0.0);
    vec2 edges = edgesAt(s, 0.0, centre.w);
    vec3 left = onScreen(centre + edges.x * s.side), right = onScreen(centre + edges.y * s.side), ridge = vec3(0.0);
#ifdef FOLD
    bool folded = isFolded(s);
    ridge = onScreen(centre + 0.5 * (edges.x + edges.y) * s.side + foldAt(s, h, 0.0));
#endif
    for (int k = 1; k <= s.segments; k++) {
        float v = float(k) / float(s.segments);
        centre = centreAt(s, v);
        edges = edgesAt(s, v, centre.w);
        vec3 nextLeft = onScreen(centre + edges.x * s.side), nextRight = onScreen(centre + edges.y * s.side);
#ifdef FOLD
        vec3 nextRidge = folded ? onScreen(centre + 0.5 * (edges.x + edges.y) * s.side + foldAt(s, h, v)) : nextRight;
        if (!folded) ridge = right;
        shown = fillQuad(left, ridge, nextLeft, nextRidge, primitive_id) || shown;
        if (folded) shown = fillQuad(ridge, right, nextRidge, nextRight, primitive_id) || shown;
        ridge = nextRidge;
#else
        shown = fillQuad(left, right, nextLeft, nextRight, primitive_id) || shown;
#endif
        left = nextLeft;
        right = nextRight;
        primitive_id++;
    }
#ifdef TWO_PASSES
    if (!writing_ids && shown) defer(WON, index);
#endif
}
