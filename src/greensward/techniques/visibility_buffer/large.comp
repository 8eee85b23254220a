// Draws the blades that raster.comp left over, clipped at the near plane: a column of workgroups for each, an invocation for
// each row of the picture.
#include "culling/blade_bounds.glsl"
#include "techniques/visibility_buffer/strip.glsl"
#include "techniques/visibility_buffer/fill.glsl"
#include "techniques/visibility_buffer/lists.glsl"

layout(local_size_x = 64) in;

uniform uint first_primitive_id;

struct Polygon { vec3 corners[5]; int count; };

void add(inout Polygon p, vec4 clip) {
    if (p.count < 5) p.corners[p.count++] = onScreen(clip);
}

void addEdge(inout Polygon p, vec4 from, vec4 to) {
#ifdef SHADOW
    add(p, from);
#else
    float from_m = depthOfClip(from), to_m = depthOfClip(to), near_m = view.range_m.x;
    bool here = from_m >= near_m;
    if (here) add(p, from);
    if (here != (to_m >= near_m)) {
        // the same point for both directions of the edge
        vec4 low = from_m < to_m ? from : to, high = from_m < to_m ? to : from;
        float low_m = min(from_m, to_m), high_m = max(from_m, to_m);
        add(p, mix(low, high, (near_m - low_m) / (high_m - low_m)));
    }
#endif
}

// Turned blades are wider than tall: their columns are dealt out
void fillPolygon(vec4 a0, vec4 a1, vec4 b1, vec4 b0, bool turned, uint primitive_id) {
    Polygon p;
    p.count = 0;
    addEdge(p, a0, a1);
    addEdge(p, a1, b1);
    addEdge(p, b1, b0);
    addEdge(p, b0, a0);
    if (p.count < 3) return;
    vec2 slope = slopeOf(p.corners[0], p.corners[1], p.corners[3 % p.count], p.corners[2]);
    vec2 size = turned ? view.size_px.yx : view.size_px.xy, ends = vec2(1e9, -1e9), tall = ends;
    vec3 anchor = p.corners[0];
    for (int i = 0; i < p.count; i++) {
        if (turned) p.corners[i] = p.corners[i].yxz;
        tall = vec2(min(tall.x, p.corners[i].y), max(tall.y, p.corners[i].y));
        ends = vec2(min(ends.x, p.corners[i].z), max(ends.y, p.corners[i].z));
    }
    ivec2 rows = within(tall.x, tall.y, size.y);
    int every = 64 * int(gl_NumWorkGroups.y), first = 64 * int(gl_WorkGroupID.y) + int(gl_LocalInvocationID.x);
    for (int row = rows.x + first; row < rows.y; row += every) {
        vec2 span = vec2(1e9, -1e9);
        for (int i = 0; i < p.count; i++) widen(span, float(row), p.corners[i], p.corners[(i + 1) % p.count]);
        ivec2 columns = within(span.x, span.y, size.x);
        for (int column = columns.x; column < columns.y; column++) {
            ivec2 pixel = turned ? ivec2(row, column) : ivec2(column, row);
            writeNearest(pixelIndex(pixel), clamp(anchor.z + dot(slope, vec2(pixel) - anchor.xy), ends.x, ends.y), primitive_id);
        }
    }
}

void drawBlade(uint index) {
    Blade b;
    BladeBounds h;
    if (!boundsOf(index, b, h)) return;
    Strip s = stripOf(b, h, leafWidth(b, h));
    uint primitive_id = first_primitive_id + 32u * index;
    vec2 a = s.c0.xy / max(s.c0.w, 0.01), c = s.c2.xy / max(s.c2.w, 0.01);
    bool turned = abs(c.x - a.x) * view.size_px.x > abs(c.y - a.y) * view.size_px.y;
    vec4 centre = s.c0;
    vec2 edges = edgesAt(s, 0.0, centre.w);
    vec4 left = centre + edges.x * s.side, right = centre + edges.y * s.side, ridge = vec4(0.0);
#ifdef FOLD
    bool folded = isFolded(s);
    ridge = centre + 0.5 * (edges.x + edges.y) * s.side + foldAt(s, h, 0.0);
#endif
    for (int k = 1; k <= s.segments; k++) {
        float v = float(k) / float(s.segments);
        centre = centreAt(s, v);
        edges = edgesAt(s, v, centre.w);
        vec4 nextLeft = centre + edges.x * s.side, nextRight = centre + edges.y * s.side;
#ifdef FOLD
        vec4 nextRidge = folded ? centre + 0.5 * (edges.x + edges.y) * s.side + foldAt(s, h, v) : nextRight;
        if (!folded) ridge = right;
        fillPolygon(left, ridge, nextRidge, nextLeft, turned, primitive_id);
        if (folded) fillPolygon(ridge, right, nextRight, nextRidge, turned, primitive_id);
        ridge = nextRidge;
#else
        fillPolygon(left, right, nextRight, nextLeft, turned, primitive_id);
#endif
        left = nextLeft;
        right = nextRight;
        primitive_id++;
    }
}

void main() {
    for (uint i = gl_WorkGroupID.x; i < lists.listed[LARGE]; i += gl_NumWorkGroups.x) drawBlade(deferredBlade(LARGE, i));
}
