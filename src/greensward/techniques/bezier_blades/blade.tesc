#include "layout/BladeRecord"
#include "layout/DrawCommand"

layout(vertices = 1) out;

layout(std430) readonly buffer Records { BladeRecord records[]; };
layout(std430) readonly buffer Commands { DrawCommand commands[]; };

uniform int command;

flat in uint patchRecord[];
patch out uint record;

void main() {
    record = patchRecord[0];
    // the last instance may have more patches than are left
    bool drawn = record < commands[command].survivors;
    float level = drawn ? unpackHalf2x16(records[record].level_and_shape).x : 0.0;
    gl_TessLevelOuter[0] = gl_TessLevelOuter[2] = level;
    gl_TessLevelOuter[1] = gl_TessLevelOuter[3] = min(level, 1.0);
    gl_TessLevelInner[0] = 1.0;  // drivers promote it to 2 where the level is above 1: the middle column carries the fold
    gl_TessLevelInner[1] = level;
}
