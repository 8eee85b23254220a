uniform sampler2DArray flower_images;  // square root of the colour; alpha

in vec3 uv;

// Sharp up to a level at which petals and stem are still told apart
bool isCut() { return textureLod(flower_images, uv, min(textureQueryLod(flower_images, uv.xy).x, 3.0)).a < 0.4; }

#ifdef SHADOW
void main() {
    if (isCut()) discard;
}
#else
#include "shaders/emit.glsl"

in vec3 position_rs;
in vec4 previousClip;
flat in uint flower;
flat in float tint;

void main() {
    if (isCut()) discard;
    vec3 colour = texture(flower_images, uv).rgb, toEye = normalize(view.eye_rs.xyz - position_rs * view.eye_rs.w);
    Surface s;
    s.baseColour = colour * colour * mix(0.85, 1.1, tint) * mix(0.6, 1.0, smoothstep(0.0, 0.6, uv.y));
    s.transmittance = 0.55;
    s.normal_ws = normalize(toEye + vec3(0.0, 0.9, 0.0));
    s.occlusion = mix(0.3, 1.0, smoothstep(0.0, 0.8, uv.y));
    s.roughness = 0.7;
    s.surfaceClass = CLASS_FLOWER;
    s.bladeNumber = BLADE_NUMBER_MASK - flower;  // from the other end than those of blades
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
