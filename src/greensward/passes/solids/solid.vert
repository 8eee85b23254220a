// A mesh of unit size, scaled, turned and placed as each of the objects in view that have its shape.
#include "layout/View"
#include "layout/Thing"
#include "layout/Where"

in vec3 corner;
in vec3 normal;
in vec4 tint;  // of the mesh, where w is 1
in vec2 texel;
in vec4 surface;

layout(std430) readonly buffer Things { Thing things[]; };
layout(std430) readonly buffer Wheres { Where wheres[]; };  // from the anchor
layout(std430) readonly buffer Seen { uint seen[]; };  // objects in view, those of this draw together

uniform int first;

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
    uint which = seen[first + gl_InstanceID];
    Thing thing = things[which];
    Where where = wheres[which];
    number = which + 1u;  // in the scene
    vec4 own = vec4(corner * thing.size, 1.0);
    own.y += corner.y > 1.5 ? thing.stretch_m : 0.0;
    vec3 ownNormal = normalize(normal / thing.size);
    vec3 position_ws = vec3(dot(where.now[0], own), dot(where.now[1], own), dot(where.now[2], own));
    vec3 before_ws = vec3(dot(where.before[0], own), dot(where.before[1], own), dot(where.before[2], own));
    normal_ws = vec3(dot(where.now[0].xyz, ownNormal), dot(where.now[1].xyz, ownNormal), dot(where.now[2].xyz, ownNormal));
    local = own.xyz;
    worn = thing.weathered;
#ifdef PICTURES
    texel_uv = texel;
    surface_of = surface;
#endif
    colour = vec4(mix(thing.paint.rgb, tint.rgb, tint.w), thing.paint.w);
    previousClip = view.previous_clip_from_relative * vec4(before_ws - view.origin_ws.xyz, 1.0);
    gl_ClipDistance[0] = position_ws.y - view.clip_below_m;
    gl_Position = view.jittered_clip_from_relative * vec4(position_ws - view.origin_ws.xyz, 1.0);
}
