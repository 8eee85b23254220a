#include "techniques/bezier_blades/record.glsl"

layout(vertices = 1) out;

layout(std430, binding = 5) readonly buffer Records { Record records[]; };
layout(std430, binding = 11) readonly buffer Commands { uint commands[]; };  // the last of each five: how many are drawn

uniform int command;

flat in uint patchRecord[];
patch out uint record;

void main() {
    record = patchRecord[0];
    // the last instance may have more patches than are left
    bool drawn = record < commands[5 * command + 4];
    float level = drawn ? unpackHalf2x16(records[record].levelAndShape).x : 0.0;
    gl_TessLevelOuter[0] = gl_TessLevelOuter[2] = level;
    gl_TessLevelOuter[1] = gl_TessLevelOuter[3] = min(level, 1.0);
    gl_TessLevelInner[0] = 1.0;  // drivers promote it to 2 where the level is above 1: the middle column carries the fold
    gl_TessLevelInner[1] = level;
}
