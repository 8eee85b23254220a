// The regular grid of patches, and what each says of its blades (Jahrmann & Wimmer 2013, section 4).
#include "shaders/blade.glsl"

uniform usampler2D patch_numbers;  // of each patch, its row
uniform sampler2D patch_rows;
uniform float patch_m;
uniform ivec2 first_patch;   // of the texture
uniform ivec2 anchor_patch;  // in which the anchor lies, and where in it
uniform vec2 in_patch;

struct Parameters {
    float density;     // part of the blades that stay
    float bending_m, smoothness;
    vec2 width_m;      // least and greatest; below 0 where the species says it
    vec2 height_m;
};

ivec2 patchAt(vec2 xz) { return anchor_patch + ivec2(floor(xz / patch_m + in_patch)); }

Parameters parametersOf(ivec2 place) {
    ivec2 at = place - first_patch;
    bool known = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, textureSize(patch_numbers, 0)));
    int row = known ? int(texelFetch(patch_numbers, at, 0).r) : 0;
    vec4 own = texelFetch(patch_rows, ivec2(0, row), 0), size = texelFetch(patch_rows, ivec2(1, row), 0);
    return Parameters(own.x, own.y, own.z, size.xy, size.zw);
}

// Blades of objects are on no patch
Parameters parametersOnObject() {
    Parameters own = parametersOf(first_patch - 1);
    own.density = 1.0;
    return own;
}
