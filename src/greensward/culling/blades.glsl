// The blades of a page, as they are stored.
#include "shaders/blade.glsl"

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) readonly buffer Poses { Pose poses[]; };

bool fetchBlade(uint index, out Blade b) {
    b = blades[index];
    return true;
}

void poseNow(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    unpackPose(poses[index].now, root, control, tip);
}

void poseBefore(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    unpackPose(poses[index].previous, root, control, tip);
}
