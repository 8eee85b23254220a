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

void main() {
    float away = distance(position_rs + view.origin_ws.xyz, view.camera_ws.xyz);
    // some of the ground shows where grass is thin, and at the end of its reach
    float chance = unit(hash3(uvec3(ivec3(floor(16.0 * uv), bladeId))).x);
    if (chance >= cover * (1.0 - farFade(away)) || away >= sward.blades_m) discard;
    vec3 texel = texture(tile_image, uv).rgb;
    texel *= texel;
    Surface s;
    s.baseColour = tile_painted ? texel : 2.0 * texel * material.rgb;
    s.transmittance = 0.9 * material.w;
    s.normal_ws = normal_ws;
    s.occlusion = 0.9;
    s.roughness = 0.95;
    s.surfaceClass = CLASS_GRASS;
    s.bladeId = bladeId;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
