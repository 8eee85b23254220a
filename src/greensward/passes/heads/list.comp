// Compaction: blades of the heads of each level, and a draw command for each level.
#include "culling/chunk_items.glsl"
#include "culling/survivors.glsl"
#include "layout/DrawCommand"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Heads { uint heads[]; };
layout(std430) writeonly buffer Listed { uint listed[]; };
layout(std430) buffer Commands { DrawCommand commands[]; };  // the first has the sum, those of the levels follow

const uint LEVELS = 3u;

uniform uint room;           // for the heads of a level
uniform uvec3 vertices;      // of an instance
uniform uvec3 instances;     // of a head

uint placeOf(uint word, uint lane) { return compactedIndex(word, lane, LEVELS * uint(chunk_count)); }

void main() {
    uint word = workgroupIndex(), lane = gl_LocalInvocationID.x, chunks_ = uint(chunk_count);
    if (word >= LEVELS * chunks_) return;
    uint level = word / chunks_, first = placeOf(level * chunks_, 0u);
    if (word == level * chunks_ && lane == 0u) {
        uint end = level + 1u < LEVELS ? placeOf(word + chunks_, 0u) : commands[0].survivors;
        commands[1u + level] = DrawCommand(vertices[level], (end - first) * instances[level], 0u, 0u, end - first);
    }
    if (!survives(word, lane)) return;
    uint at = chunks[uint(first_chunk) + word - level * chunks_].first + lane;
    listed[level * room + placeOf(word, lane) - first] = heads[at];
}
