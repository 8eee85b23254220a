// Sorts the heads of a run of chunks by level of detail: which of them a view shows at each, a bit for each.
#include "passes/heads/head.glsl"
#include "culling/chunk_items.glsl"
#include "culling/tests.glsl"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Heads { uint heads[]; };
layout(std430) buffer Masks { uint masks[]; };  // all 0 before; the chunks of each level after those of the one before

uniform vec3 heads_each;  // as which one may be drawn, by level
uniform vec2 level_px;

bool showsAt(uint index, out int level) {
    Head h;
    if (!findHead(index, h)) return false;
    float depth = dot(view.axis_rs.xyz, h.tip) + view.axis_rs.w, broad = (h.flower ? 1.0 : 0.4) * h.size;
    float pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
#ifdef SHADOW
    level = FAR;
#else
    level = broad > level_px.x * pixel ? 0 : broad > level_px.y * pixel ? 1 : FAR;
#endif
#ifdef FRUSTUM
    vec2 grown = grownSize(h, heads_each[level]);
    float others = min(h.each, heads_each[level]) - 1.0, reach = 1.2 * max(grown.x, grown.y);
    if (others > 0.0) reach += apart(bladeSpecies(h.blade)) * spread(others) * 1.5;
    return !outside(h.tip, h.tip, h.tip, reach);
#else
    return true;
#endif
}

void main() {
    uint at;
    int level;
    if (takeItem(at) && showsAt(heads[at], level)) atomicOr(masks[uint(level * chunk_count) + workgroupIndex()], 1u << gl_LocalInvocationID.x);
}
