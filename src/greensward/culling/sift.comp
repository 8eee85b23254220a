// Which blades of a run of chunks a view shows: a bit for each.
#include "culling/shows.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 8) buffer Masks { uint masks[]; };  // all 0 before

uniform int firstChunk;
uniform int chunkCount;

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunkCount)) return;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    // no barrier and no shared mask: on NVIDIA lanes were lost at a barrier after code that diverged
    Blade b;
    Hull h;
    float width;
    if (lane < run.y && shows(run.x + lane, b, h, width)) atomicOr(masks[chunk], 1u << lane);
}
