#ifdef SHADOW
void main() {}
#else
#include "shaders/noise.glsl"
#include "shaders/emit.glsl"

in vec3 local;
in vec3 normal_ws;
in vec4 colour;
in vec4 previousClip;

void main() {
    // weathering: streaks along the height, and blotches
    float streak = simplex(vec2(local.x + local.z * 1.7, local.y * 0.12) * 42.0, 3u);
    float blotch = octaves(local.xy * 3.0 + local.z * 2.0, 9u, 3, 0.6, 2.3);
    Surface s;
    s.baseColour = colour.rgb * (1.0 + 0.14 * streak + 0.22 * blotch);
    s.transmittance = 0.0;
    s.normal_ws = normalize(normal_ws);
    s.occlusion = 0.9;
    s.roughness = colour.w;
    s.surfaceClass = CLASS_OBJECT;
    s.bladeNumber = 0u;
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
