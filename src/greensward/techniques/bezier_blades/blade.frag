#ifdef SHADOW
void main() {}
#else
#include "shaders/emit.glsl"
#include "techniques/blades/material.glsl"
#include "layout/BladeRecord"

in vec4 normalAndHeight;
in vec3 previousClip;
flat in uint shown;

layout(std430) readonly buffer Records { BladeRecord records[]; };

uniform uint first_blade_number;

void main() {
    vec4 root = unpackUnorm4x8(records[shown].root_colour), tip = unpackUnorm4x8(records[shown].tip_colour);
    vec4 place = unpackUnorm4x8(records[shown].shading);
    root.rgb *= root.rgb;
    tip.rgb *= tip.rgb;
    Surface s = leafSurface(Material(root, tip, 4.0 * place.x, place.y, place.z, vec3(0.0), 0.0), normalAndHeight.w);
    s.normal_ws = normalAndHeight.xyz;
    s.bladeNumber = first_blade_number + records[shown].blade;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
