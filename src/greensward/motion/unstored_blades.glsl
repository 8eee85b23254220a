// The blades of a page that are not stored: grown from the seed and bent whenever they are looked up. It stands in for
// culling/blades.glsl.
#include "sowing/ground_blade.glsl"
#include "motion/pose.glsl"
#include "culling/tests.glsl"
#include "layout/UnstoredTile"

layout(std430) readonly buffer Tiles { UnstoredTile tiles[]; };
layout(std430) readonly buffer TileOf { uint tile_of[]; };  // of 32 candidates

uniform float time_s;
uniform float previous_time_s;
uniform float tallest_m;

bool fetchBlade(uint index, out Blade b) {
    UnstoredTile t = tiles[tile_of[index >> 5u]];
    Seed seed = seedOf(Tile(t.x, t.z, t.level, 0u), index - t.first_candidate);
    if (!isNeeded(seed, distance(seed.root, view.camera_ws.xyz))) return false;
#ifdef FRUSTUM
    vec3 root = seed.root - view.origin_ws.xyz;
    if (outside(root, root, root, 2.0 * tallest_m)) return false;
#endif
    return sprout(seed, b);
}

// As stored ones are, in halfs
void poseAt(Blade b, float time_s, vec3 root, out vec3 control, out vec3 tip) {
    bentControlPoints(b, time_s, control, tip);
    unpackPose(packPose(control, tip), root, control, tip);
}

void poseNow(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    poseAt(b, time_s, root, control, tip);
}

void poseBefore(uint index, Blade b, vec3 root, out vec3 control, out vec3 tip) {
    poseAt(b, previous_time_s, root, control, tip);
}
