// Compaction: indices of the blades that survive culling.
#include "culling/compaction.glsl"

layout(local_size_x = 32) in;

layout(std430) writeonly buffer Listed { uint listed[]; };


void main() {
    uint chunk = workgroupIndex(), lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunk_count) || !survives(chunk, lane)) return;
    listed[compactedIndex(chunk, lane)] = chunks[uint(first_chunk) + chunk].first + lane;
}
