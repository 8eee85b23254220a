// The outline from the alpha texture, the colour from one of three (Derstroff 2024, sections 2.1, 2.4 and 2.5).
uniform sampler2D outline_image;

uniform float opacity;

in vec2 uv;
flat in uvec2 numberAndTexture;

// Discarded if the alpha value is below the threshold; less half of what 8 bits tell apart, as filtering rounds
bool isCut() { return textureLod(outline_image, uv, 0.0).r < opacity - 0.5 / 255.0; }

#ifdef SHADOW
void main() {
    if (isCut()) discard;
}
#else
#include "shaders/emit.glsl"
#include "techniques/blades/material.glsl"
#include "techniques/geometry_billboards/bend.glsl"

uniform sampler2DArray colour_images;  // square roots: of colours, or of the shares of root, tip and dry colour
uniform uint painted;                  // bits of the textures that hold colours

in vec3 normal_ws;
in vec3 previousClip;
flat in uvec4 material;
flat in uint dry;
#ifdef TUBE
in vec3 toViewer;
flat in vec3 across;
in vec3 stoodOut;
in vec2 nearer;
#endif

vec3 decoded(uint bits) {
    vec3 root = unpackUnorm4x8(bits).rgb;
    return root * root;
}

vec3 colourAt(vec3 root, vec3 tip) {
    vec3 texel = texture(colour_images, vec3(uv, float(numberAndTexture.y))).rgb;
    texel *= texel;
    return (painted >> numberAndTexture.y & 1u) != 0u ? texel : texel.r * root + texel.g * tip + texel.b * decoded(dry);
}

void main() {
    if (isCut()) discard;
    vec2 place = unpackUnorm2x16(material.z);
    vec3 root = decoded(material.x), tip = decoded(material.y);
    float transmittance = unpackUnorm4x8(material.x).w, roughness = unpackUnorm4x8(material.y).w;
    Surface s = leafSurface(Material(vec4(root, transmittance), vec4(tip, roughness), 4.0 * place.x, place.y, 1.0, vec3(0.0), 0.0), 1.0 - uv.y);
    s.baseColour = colourAt(root, tip);
    s.normal_ws = normal_ws;
    s.bladeNumber = numberAndTexture.x;
    s.previousClip = previousClip.xyzz;
#ifdef TUBE
    float out_ = tubeOffset(uv.x);
    // far ones are shaded as others are: as a wall of blades
    s.normal_ws = mix(tubeNormal(across, normalize(toViewer), uv.x), octahedralDecode(unpackSnorm2x16(material.w)), 0.8 * place.y);
    s.previousClip += out_ * stoodOut.xyzz;
    gl_FragDepth = gl_FragCoord.z + out_ * nearer.x;
    emitSurface(s, fragmentDepth() + out_ * nearer.y);
#else
    emitSurface(s);
#endif
}
#endif
