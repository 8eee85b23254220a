// What a patch of the ground says of its blades (Jahrmann & Wimmer 2013, section 4).
#include "shaders/blade.glsl"

uniform float bending_m;
uniform float smoothness;

struct Parameters {
    float density;     // part of the blades that stay
    vec2 width_m;      // least and greatest; below 0 where the species says it
    vec2 height_m;
    float bending_m, smoothness;
};

#if PATCHES > 0
uniform vec4 patch_area_m[PATCHES];  // x and z, least and greatest
uniform vec4 patch_size_m[PATCHES];  // width and height
uniform vec3 patch_own[PATCHES];     // density, bending, smoothness
#endif

Parameters parametersAt(Blade b) {
    Parameters own = Parameters(1.0, vec2(-1.0), vec2(-1.0), bending_m, smoothness);
#if PATCHES > 0
    if (isOnObject(b)) return own;
    for (int i = 0; i < PATCHES; i++) {
        vec4 area = patch_area_m[i];
        if (b.x < area.x || b.z < area.y || b.x > area.z || b.z > area.w) continue;
        own = Parameters(patch_own[i].x, patch_size_m[i].xy, patch_size_m[i].zw, patch_own[i].y, patch_own[i].z);
    }
#endif
    return own;
}
