#ifdef SHADOW
void main() {}
#else
#include "shaders/surface.glsl"
#include "techniques/bezier_blades/record.glsl"

in vec4 normalAndHeight;
in vec3 previousClip;
flat in uint shown;

layout(std430, binding = 5) readonly buffer Records { Record records[]; };

uniform uint firstId;

void main() {
    vec4 root = unpackUnorm4x8(records[shown].rootColour), tip = unpackUnorm4x8(records[shown].tipColour);
    vec4 place = unpackUnorm4x8(records[shown].look);
    float v = normalAndHeight.w, height = clamp(4.0 * place.x * v, 0.0, 1.0);
    Surface s;
    s.baseColour = mix(root.rgb * root.rgb, tip.rgb * tip.rgb, smoothstep(0.0, 0.85, v));
    // thin at the tip; dark where the sward closes over it, less so where one far blade stands for many
    s.transmittance = root.w * mix(0.45, 1.0, v);
    s.roughness = tip.w;
    s.occlusion = mix(mix(0.2, 0.8, place.y), 1.0, height * (2.0 - height));
    s.normal_ws = normalAndHeight.xyz;
    s.surfaceClass = CLASS_GRASS;
    s.bladeId = firstId + records[shown].blade;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
