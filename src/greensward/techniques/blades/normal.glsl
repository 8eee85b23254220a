// Shading normal of a leaf.
#include "layout/Leaf"

// A normal on the side that is seen
vec3 towards(vec3 toEye, vec3 normal_ws) { return dot(normal_ws, toEye) < 0.0 ? -normal_ws : normal_ws; }

// Round, not flat: the normal turns across the blade; far away it is the wall's and stops sparkling.
// Its length does not matter, as it is stored as a direction.
vec3 roundedNormal(vec3 normal_ws, vec3 trueSide, vec3 side, vec3 toEye, float u, vec3 wall, float far) {
    normal_ws = towards(toEye, normal_ws) + 1.9 * leaf.roundness * (u - 0.5) * (dot(side, trueSide) < 0.0 ? -trueSide : trueSide);
    return mix(normal_ws, wall, 0.8 * far);
}

vec3 leafNormal(vec3 trueSide, vec3 side, vec3 tangent, vec3 toEye, float u, vec3 wall, float far) {
    return roundedNormal(cross(trueSide, tangent), trueSide, side, toEye, u, wall, far);
}
