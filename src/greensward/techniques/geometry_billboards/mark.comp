// Finds what a view shows: a workgroup takes a patch, an invocation a cell, and marks it for each level that it is drawn at.
#include "techniques/geometry_billboards/rings.glsl"

layout(local_size_x = 64) in;

layout(std430) buffer Masks { uint masks[]; };  // all 0 before; two words of a patch, one level behind the other

#ifdef FRUSTUM
// A whole patch, by the least and the greatest height of the ground
uniform vec2 heights_m;

bool isPatchOutside(Cell c, uint lane) {
    vec2 height = heights_m - view.origin_ws.y;
    vec3 size = vec3(4.0 * c.edge_m, 0.5 * (height.y - height.x), 4.0 * c.edge_m);
    vec2 corner = c.corner_m - vec2(lane & 7u, lane >> 3u) * c.edge_m;
    return isOutsideWithBlades(vec3(corner.x, height.x, corner.y) + size, size);
}
#endif

void main() {
    uint number = workgroupIndex(), lane = gl_LocalInvocationID.x;
    Cell c;
    if (!cellOf(number, lane, c)) return;
#ifdef FRUSTUM
    if (isPatchOutside(c, lane)) return;
#endif
    measure(c);
    uint levels = levelsOf(c);
#ifdef SHADOW
    levels &= 7u;  // what is flat casts no shade
#endif
    if (levels == 0u) return;
#ifdef FRUSTUM
    if (isOutside(c, levels == 8u)) return;
#endif
    for (int level = 0; level < LEVELS; level++)
        if ((levels >> level & 1u) != 0u) atomicOr(masks[2u * (uint(level * patches) + number) + (lane >> 5u)], 1u << (lane & 31u));
}
