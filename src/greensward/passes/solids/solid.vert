// An instance of a mesh of unit size, scaled, turned and placed.
#include "layout/View"

in vec3 corner;
in vec3 normal;
in vec4 tint;  // of the mesh, where w is 1
in vec2 texel;
in vec4 surface;
in vec4 now0;
in vec4 now1;
in vec4 now2;
in vec4 before0;
in vec4 before1;
in vec4 before2;
in vec4 paint;
in float weathered;
in vec4 size_and_number;  // of the instance, where the mesh is of unit size; its number in the scene, from 1 on

out vec3 local;
out vec3 normal_ws;
out vec4 colour;
out float worn;
#ifdef PICTURES
out vec2 texel_uv;
flat out vec4 surface_of;
#endif
out vec4 previousClip;
flat out uint number;

void main() {
    vec3 size = size_and_number.xyz;
    number = uint(size_and_number.w);
    vec4 own = vec4(corner * size, 1.0);
    vec3 ownNormal = normalize(normal / size);
    vec3 position_ws = vec3(dot(now0, own), dot(now1, own), dot(now2, own));
    vec3 before_ws = vec3(dot(before0, own), dot(before1, own), dot(before2, own));
    normal_ws = vec3(dot(now0.xyz, ownNormal), dot(now1.xyz, ownNormal), dot(now2.xyz, ownNormal));
    local = own.xyz;
    worn = weathered;
#ifdef PICTURES
    texel_uv = texel;
    surface_of = surface;
#endif
    colour = vec4(mix(paint.rgb, tint.rgb, tint.w), paint.w);
    previousClip = view.previous_clip_from_relative * vec4(before_ws - view.origin_ws.xyz, 1.0);
    gl_ClipDistance[0] = position_ws.y - view.clip_below_m;
    gl_Position = view.jittered_clip_from_relative * vec4(position_ws - view.origin_ws.xyz, 1.0);
}
