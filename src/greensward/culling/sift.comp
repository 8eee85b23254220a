// Which blades of a run of chunks a view shows: a bit for each.
#include "culling/hull.glsl"
#include "culling/tests.glsl"
#include "culling/width"

layout(local_size_x = 32) in;

layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 8) buffer Masks { uint masks[]; };  // all 0 before

uniform int firstChunk;
uniform int chunkCount;

bool shows(uint index) {
    Blade b;
    Hull h;
    if (!hullOf(index, b, h)) return false;
    float width = widthOf(b, h);
    if (width < 0.0) return false;
#ifdef ORIENTATION
    if (width == 0.0) return false;
#endif
#ifdef FRUSTUM
    if (outside(h.v0, h.v1, h.v2, width)) return false;
#endif
#ifdef OCCLUSION
    if (hidden(h.v0, h.v1, h.v2, width)) return false;
#endif
    return true;
}

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunkCount)) return;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    // no barrier and no shared mask: on NVIDIA lanes were lost at a barrier after code that diverged
    if (lane < run.y && shows(run.x + lane)) atomicOr(masks[chunk], 1u << lane);
}
