// The blades of a page: stored, or grown from the seed whenever they are looked at. What both need is included by
// culling/hull.glsl, as a file is included once, and here that may be in the part that is left out.

#ifdef UNSTORED
#include "sowing/ground_blade.glsl"
#include "motion/posture.glsl"

layout(std430, binding = 0) readonly buffer Tiles { ivec4 tiles[]; };    // x, z, level, first candidate
layout(std430, binding = 1) readonly buffer TileOf { uint tileOf[]; };  // of 32 candidates

uniform float timeNow;
uniform float timePrevious;
uniform float tallest_m;

bool fetchBlade(uint index, out Blade b) {
    ivec4 t = tiles[tileOf[index >> 5u]];
    Seed seed = seedOf(Tile(t.x, t.y, t.z, 0u), index - uint(t.w));
    if (!isKept(seed, distance(seed.root, view.camera_ws.xyz))) return false;
#ifdef FRUSTUM
    vec3 root = seed.root - view.origin_ws.xyz;
    if (outside(root, root, root, 2.0 * tallest_m)) return false;
#endif
    return sprout(seed, b);
}

// As stored ones are, in halfs
void postureAt(Blade b, float time_s, vec3 root, out vec3 control, out vec3 tip) {
    stand(b, time_s, control, tip);
    unpackPosture(packPosture(control, tip), root, control, tip);
}

void postureNow(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    postureAt(b, timeNow, root, control, tip);
}

void postureBefore(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    postureAt(b, timePrevious, root, control, tip);
}
#else
layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) readonly buffer Postures { Posture postures[]; };

bool fetchBlade(uint index, out Blade b) {
    b = blades[index];
    return true;
}

void postureNow(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    unpackPosture(postures[index].now, root, control, tip);
}

void postureBefore(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    unpackPosture(postures[index].previous, root, control, tip);
}
#endif
