// Writes blades as they are now from how they were sown: grown to their age, and carried along by their object.
#include "shaders/blade.glsl"
#ifdef GROWTH
#include "sowing/growth.glsl"
#endif

layout(local_size_x = 64) in;

layout(std430, binding = 0) readonly buffer Sown { Blade sown[]; };
layout(std430, binding = 1) writeonly buffer Blades { Blade blades[]; };

uniform mat4 placed;  // rigid
uniform bool moves;
uniform uint bladeCount;

void carry(inout Blade b, mat4 matrix) {
    mat3 turn = mat3(matrix);
    vec3 root = (matrix * vec4(bladeRoot(b), 1.0)).xyz;
    vec3 control = root + turn * (bladeControl(b) - bladeRoot(b)), tip = root + turn * (bladeTip(b) - bladeRoot(b));
    vec3 front, side, east, north;
    bladeFrame(bladeUp(b), b.facing, front, side);
    b.up = packSnorm2x16(octahedralEncode(turn * bladeUp(b)));
    // the frame from which the angle is measured does not turn along
    bladeFrame(bladeUp(b), 0.0, east, side);
    north = cross(bladeUp(b), east);
    front = turn * front;
    b.facing = atan(dot(front, north), dot(front, east));
    b.x = root.x; b.y = root.y; b.z = root.z;
    b.x1 = control.x; b.y1 = control.y; b.z1 = control.z;
    b.x2 = tip.x; b.y2 = tip.y; b.z2 = tip.z;
}

void main() {
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (i >= bladeCount) return;
    Blade b = sown[i];
#ifdef GROWTH
    grow(b);
#endif
    if (moves) carry(b, placed);
    blades[i] = b;
}
