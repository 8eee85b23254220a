// Writes the marked cells in order, level by level, and the draw commands of the levels.
#include "techniques/geometry_billboards/rings.glsl"
#include "culling/survivors.glsl"
#include "layout/DrawCommand"
#include "layout/BillboardTile"

layout(local_size_x = 64) in;

layout(std430) buffer Commands { DrawCommand commands[]; };  // the one behind the levels' has the number of all
layout(std430) writeonly buffer Tiles { BillboardTile tiles[]; };

uniform uvec4 blades;      // of a tile, by level
uniform uint roots;
uniform uint first_flat;   // patch

uint compactedIndex(uint word, uint bit) { return compactedIndex(word, bit, uint(2 * LEVELS * patches)); }

void command(uint level) {
    uint first = compactedIndex(2u * level * uint(patches), 0u);
    uint next = level == 3u ? commands[LEVELS].survivors : compactedIndex(2u * (level + 1u) * uint(patches), 0u);
    uint vertices = level == 3u ? 4u : uint(ceil(float(blades[level]) * view.density));
    commands[level] = DrawCommand(vertices, next - first, 0u, first, vertices * (next - first));
}

void main() {
    uint number = workgroupIndex(), lane = gl_LocalInvocationID.x;
    if (number == 0u && lane < uint(LEVELS)) command(lane);
    Cell c;
    if (!cellOf(number, lane, c)) return;
    for (uint level = 0u; level < uint(LEVELS); level++) {
        uint word = 2u * (level * uint(patches) + number) + (lane >> 5u), bit = lane & 31u;
        if (!survives(word, bit)) continue;
        measure(c);
        vec4 first, second;
        vec3 along = vec3(c.edge_m, 0.0, 0.0);
        planesOf(vec3(0.0, c.heights[0], 0.0), along.yyx + vec3(0.0, c.heights[1], 0.0), along + vec3(0.0, c.heights[2], 0.0),
                 along.xyx + vec3(0.0, c.heights[3], 0.0), first, second);
        BillboardTile tile;
        tile.x = c.at.x; tile.z = c.at.y;
        tile.left_m = c.corner_m.x; tile.near_m = c.corner_m.y;
        tile.edge_m = c.edge_m;
        tile.number = level == 3u ? first_flat * PATCH * (roots - 1u) + c.number : c.number * roots;
        tile.first = float[4](first.x, first.y, first.z, first.w);
        tile.second = float[4](second.x, second.y, second.z, second.w);
        tiles[compactedIndex(word, bit)] = tile;
    }
}
