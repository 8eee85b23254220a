// Writes blades as they are now from how they were sown: grown to their age, and transformed with their object.
#include "shaders/blade.glsl"
#include "shaders/dispatch.glsl"
#ifdef GROWTH
#include "sowing/growth.glsl"
#endif

layout(local_size_x = 64) in;

layout(std430) readonly buffer Sown { Blade sown[]; };
layout(std430) writeonly buffer Blades { Blade blades[]; };

uniform mat4 placed;  // rigid
uniform bool moves;
uniform uint blade_count;

void transformBlade(inout Blade b, mat4 matrix) {
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
    uint i = workgroupIndex() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (i >= blade_count) return;
    Blade b = sown[i];
#ifdef GROWTH
    grow(b);
#endif
    if (moves) transformBlade(b, placed);
    blades[i] = b;
}
