#ifdef SHADOW
void main() {}
#else
#include "shaders/emit.glsl"

in vec4 previousClip;

void main() {
    Surface s;
    s.baseColour = vec3(0.0);  // painted by material.glsl, once per pixel that shows it
    s.transmittance = 0.0;
    s.normal_ws = vec3(0.0, 1.0, 0.0);
    s.occlusion = 1.0;
    s.roughness = 1.0;
    s.surfaceClass = CLASS_GROUND;
    s.bladeNumber = 0u;
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
