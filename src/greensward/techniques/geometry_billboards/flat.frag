// A texture of lines in other colours, which is to look like grass from afar (Derstroff 2024, section 2.4, LOD 0).
#include "shaders/emit.glsl"
#include "shaders/hash.glsl"
#include "culling/level_of_detail.glsl"

uniform sampler2D tile_image;  // square roots of colours, or of half the factors of the sward's
uniform bool tile_painted;

in vec2 uv;
in vec3 position_rs;
in vec3 normal_ws;
in vec3 previousClip;
in vec4 material;
in float cover;
flat in uint bladeId;

// Seen at a slant, a level is taken that is sharper along the longer side of a pixel's footprint
vec3 texelAt(vec2 at) {
    vec3 root = texture(tile_image, at, -1.5).rgb;
    return root * root;
}

// The same lines, many times as large: from afar tufts and drifts are told apart, not blades
float mottled() {
    vec2 turned = vec2(0.8 * uv.x - 0.6 * uv.y, 0.6 * uv.x + 0.8 * uv.y);
    return 8.0 * texelAt(turned / 5.3).g * texelAt(uv.yx / 29.0).g * texelAt(turned / 157.0).g;
}

void main() {
    float away = distance(position_rs + view.origin_ws.xyz, view.camera_ws.xyz);
    // some of the ground shows where grass is thin, and at the end of its reach
    float chance = unit(hash3(uvec3(ivec3(floor(16.0 * uv), bladeId))).x);
    if (chance >= cover * (1.0 - farFade(away)) || away >= sward.blades_m) discard;
    Surface s;
    s.baseColour = tile_painted ? texelAt(uv) : 2.0 * texelAt(uv) * mottled() * material.rgb;
    s.transmittance = 0.9 * material.w;
    s.normal_ws = normal_ws;
    s.occlusion = 0.9;
    s.roughness = 0.95;
    s.surfaceClass = CLASS_GRASS;
    s.bladeId = bladeId;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
