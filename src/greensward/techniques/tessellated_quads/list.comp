// The blades that are kept, one after the other.
#include "culling/places.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 5) writeonly buffer Listed { uint listed[]; };

uniform int firstChunk;

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunkCount) || !isKept(chunk, lane)) return;
    listed[placeOf(chunk, lane)] = chunks[uint(firstChunk) + chunk].x + lane;
}
