#ifdef SHADOW
void main() {}
#else
#include "shaders/surface.glsl"

in vec3 colour;
in vec3 normal_ws;
in vec3 gloss;
in vec4 previousClip;
flat in uint blade;

uniform uint firstId;

void main() {
    Surface s;
    s.baseColour = colour;
    s.transmittance = gloss.x;
    s.normal_ws = normalize(normal_ws);
    s.occlusion = gloss.z;
    s.roughness = gloss.y;
    s.surfaceClass = CLASS_GRASS;
    s.bladeId = firstId + blade;
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
