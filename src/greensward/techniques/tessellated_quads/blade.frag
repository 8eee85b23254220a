// The outline from a blade's alpha texture, the colour from its diffuse texture, the vegetation map or its species.
#include "shaders/hash.glsl"
uniform sampler2DArray blade_images;  // square root of the colour, alpha; a layer for each species

in vec2 uv;
flat in uvec2 numberAndSpecies;

// The outline stays sharp along the longer side of a thin blade: the finer of both derivatives picks the level
float alphaHere(float layer) {
    vec2 size = vec2(textureSize(blade_images, 0).xy);
    vec2 across = vec2(length(vec2(dFdx(uv.x), dFdy(uv.x))), length(vec2(dFdx(uv.y), dFdy(uv.y)))) * size;
    return textureLod(blade_images, vec3(uv, layer), log2(max(min(across.x, across.y), 1.0))).a;
}

bool isCut(float alpha) {
#ifdef HASHED
    // as often as it is opaque, at each point of the blade alike (Wyman & McGuire 2017, "Hashed Alpha Testing")
    uvec3 point = uvec3(uvec2(uv * vec2(8.0, 64.0)), numberAndSpecies.x);
    return alpha <= clamp(unit(hash3(point).x), 0.02, 0.98);
#else
    return alpha < 0.5;
#endif
}

#ifdef SHADOW
void main() {
    if (isCut(alphaHere(float(numberAndSpecies.y)))) discard;
}
#else
#include "shaders/emit.glsl"
#include "techniques/blades/material.glsl"

in vec3 normal_ws;
in vec3 previousClip;
flat in uvec4 material;

uniform uint own_colours;  // bits of the species that have a diffuse texture
uniform uint slender;    // and of those with an outline that leaves out most of the quad

// Section 5.1: the components vary by three random values, and a blade is darker near the ground,
// but for far ones, which stand for many.
vec3 diffuse(vec3 texel, vec3 map, float mapped, float far) {
    vec3 random = unit(hash3(uvec3(numberAndSpecies.x, 17u, 31u))) - 0.5;
    return mix(texel, map, mapped) * (1.0 + 0.3 * random.x + 0.12 * random.xyz) * mix(0.55, 1.0, max(uv.y, far));
}

void main() {
    vec4 root = unpackUnorm4x8(material.x), tip = unpackUnorm4x8(material.y), place = unpackUnorm4x8(material.z);
    // far blades stand for many, and what a slender outline leaves out would be a hole in all of them
    float filled = (slender >> numberAndSpecies.y & 1u) != 0u ? smoothstep(0.1, 0.6, place.y) : 0.0;
    if (isCut(alphaHere(float(numberAndSpecies.y)) + filled)) discard;
    root.rgb *= root.rgb;
    tip.rgb *= tip.rgb;
    Surface s = leafSurface(Material(root, tip, 4.0 * place.x, place.y, place.z, vec3(0.0), 0.0), uv.y);
    vec3 texel = texture(blade_images, vec3(uv, float(numberAndSpecies.y))).rgb;
    texel *= texel;
    s.baseColour = (own_colours >> numberAndSpecies.y & 1u) != 0u ? diffuse(texel, s.baseColour, place.w, place.y) : s.baseColour * texel;
    s.normal_ws = normal_ws;
    s.bladeNumber = numberAndSpecies.x;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
