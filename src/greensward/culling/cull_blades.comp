// Per-blade culling: which blades of a run of chunks a view shows, a bit for each.
#include "culling/visibility.glsl"
#include "culling/chunk_items.glsl"

layout(local_size_x = 32) in;

layout(std430) buffer Masks { uint masks[]; };  // all 0 before

void main() {
    // no barrier and no shared mask: on NVIDIA lanes were lost at a barrier after code that diverged
    uint index;
    Blade b;
    BladeBounds h;
    float width;
    if (takeItem(index) && isVisible(index, b, h, width)) atomicOr(masks[workgroupIndex()], 1u << gl_LocalInvocationID.x);
}
