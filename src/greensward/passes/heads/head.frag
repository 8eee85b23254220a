#ifdef SHADOW
void main() {}
#else
#include "shaders/emit.glsl"

in vec3 position_rs;
in vec3 colour;
in vec3 normal_ws;
in vec4 previousClip;
flat in uint blade;
flat in uint isFlower;

uniform uint first_blade_number;

void main() {
    vec3 toViewer = view.eye_rs.xyz - position_rs * view.eye_rs.w;
    Surface s;
    s.baseColour = colour;
    s.transmittance = isFlower == 1u ? 0.5 : 0.55;
    s.normal_ws = normalize(dot(normal_ws, toViewer) < 0.0 ? -normal_ws : normal_ws);
    s.occlusion = 1.0;
    s.roughness = 0.7;
    s.surfaceClass = isFlower == 1u ? CLASS_FLOWER : CLASS_GRASS;
    s.bladeNumber = first_blade_number + blade;
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
