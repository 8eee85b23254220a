#ifdef SHADOW
void main() {}
#else
#include "shaders/emit.glsl"
#include "techniques/blades/material.glsl"

in vec4 normalAndHeight;
in vec3 previousClip;
flat in uvec4 look;

void main() {
    vec4 root = unpackUnorm4x8(look.x), tip = unpackUnorm4x8(look.y), place = unpackUnorm4x8(look.z);
    root.rgb *= root.rgb;
    tip.rgb *= tip.rgb;
    Surface s = leafSurface(Material(root, tip, 4.0 * place.x, place.y, place.z, vec3(0.0), 0.0), normalAndHeight.w);
    s.normal_ws = normalAndHeight.xyz;
    s.bladeNumber = look.w;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
#endif
