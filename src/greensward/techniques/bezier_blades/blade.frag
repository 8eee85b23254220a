#ifdef SHADOW
void main() {}
#else
#include "shaders/emit.glsl"
#include "techniques/look.glsl"
#include "techniques/bezier_blades/record.glsl"

in vec4 normalAndHeight;
in vec3 previousClip;
flat in uint shown;

layout(std430, binding = 5) readonly buffer Records { Record records[]; };

uniform uint firstId;

void main() {
    vec4 root = unpackUnorm4x8(records[shown].rootColour), tip = unpackUnorm4x8(records[shown].tipColour);
    vec4 place = unpackUnorm4x8(records[shown].look);
    root.rgb *= root.rgb;
    tip.rgb *= tip.rgb;
    Surface s = leafSurface(Look(root, tip, 4.0 * place.x, place.y, place.z, vec3(0.0), 0.0), normalAndHeight.w);
    s.normal_ws = normalAndHeight.xyz;
    s.bladeId = firstId + records[shown].blade;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
