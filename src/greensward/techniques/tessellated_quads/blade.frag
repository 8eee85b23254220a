// The outline from a blade's alpha texture, the colour from its diffuse texture, the vegetation map or its species.
#include "shaders/hash.glsl"
uniform sampler2DArray blade_images;  // square root of the colour, alpha; a layer for each species

in vec2 uv;
flat in uvec3 identity;  // id; species; three random values, packed

// The outline stays sharp along the longer side of a thin blade: the finer of both derivatives picks the level
float alphaHere(float layer) {
    vec2 size = vec2(textureSize(blade_images, 0).xy);
    vec2 across = vec2(length(vec2(dFdx(uv.x), dFdy(uv.x))), length(vec2(dFdx(uv.y), dFdy(uv.y)))) * size;
    return textureLod(blade_images, vec3(uv, layer), log2(max(min(across.x, across.y), 1.0))).a;
}

bool isCut(float alpha) {
#ifdef HASHED
    // as often as it is opaque, at each point of the blade alike (Wyman & McGuire 2017, "Hashed Alpha Testing")
    uvec3 point = uvec3(uvec2(uv * vec2(8.0, 64.0)), identity.z);
    return alpha <= clamp(unit(hash3(point).x), 0.02, 0.98);
#else
    return alpha < 0.5;
#endif
}

#ifdef SHADOW
void main() {
    if (isCut(alphaHere(float(identity.y)))) discard;
}
#else
#include "shaders/emit.glsl"
#include "techniques/blades/material.glsl"

in vec3 normal_ws;
in vec3 previousClip;
flat in uvec4 material;

uniform uint own_colours;  // bits of the species that have a diffuse texture
uniform uint slender;    // and of those with an outline that leaves out most of the quad

// Section 5.1: the components of what a texture gives vary by three random values
vec3 varied(vec3 colour) {
    vec3 random = unpackUnorm4x8(identity.z).yzw - 0.5;
    return colour * (1.0 + 0.3 * random.x + 0.12 * random);
}

void main() {
    vec4 root = unpackUnorm4x8(material.x), tip = unpackUnorm4x8(material.y), place = unpackUnorm4x8(material.z);
    // far blades stand for many, and what a slender outline leaves out would be a hole in all of them
    float filled = (slender >> identity.y & 1u) != 0u ? smoothstep(0.1, 0.6, place.y) : 0.0;
    if (isCut(alphaHere(float(identity.y)) + filled)) discard;
    root.rgb *= root.rgb;
    tip.rgb *= tip.rgb;
    Surface s = leafSurface(Material(root, tip, 4.0 * place.x, place.y, place.z, vec3(0.0), 0.0), uv.y);
    vec3 texel = texture(blade_images, vec3(uv, float(identity.y))).rgb;
    texel *= texel;
    bool textured = (own_colours >> identity.y & 1u) != 0u;
#ifdef SHADED_ALONE
    // and a blade is darker near the ground: times the vertical texture coordinate
    s.baseColour = mix(varied(textured ? mix(texel, root.rgb, place.w) : root.rgb * texel) * uv.y, tip.rgb, place.y);
    s.occlusion = 1.0;
#else
    s.baseColour = textured ? varied(mix(texel, s.baseColour, place.w)) : s.baseColour * texel;
    // far blades stand for many
    if (textured) s.baseColour *= mix(0.55, 1.0, max(uv.y, place.y));
#endif
    s.normal_ws = normal_ws;
    s.bladeNumber = identity.x;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
