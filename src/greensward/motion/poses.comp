// Writes the analytic pose of every blade that some view of this frame needs, now and one frame ago.
#include "motion/pose.glsl"
#include "culling/chunk_items.glsl"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) writeonly buffer Poses { Pose poses[]; };

uniform float time_s;
uniform float previous_time_s;

uint[3] packedPose(Blade b, float time_s) {
    vec3 v1, v2;
    bentControlPoints(b, time_s, v1, v2);
    return packPose(v1, v2);
}

void main() {
    uint i;
    if (!takeItem(i)) return;
    Blade b = blades[i];
    Pose p;
    p.now = packedPose(b, time_s);
    p.previous = previous_time_s == time_s ? p.now : packedPose(b, previous_time_s);
    poses[i] = p;
}
