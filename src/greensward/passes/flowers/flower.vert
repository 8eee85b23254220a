// A picture on a strip of two quads that stands on its stem and turns about it to the viewer.
#include "layout/View"
#include "shaders/bezier.glsl"
#include "layout/Flower"

layout(std430) readonly buffer Flowers { Flower flowers[]; };

uniform int first_flower;
uniform int layer;

out vec3 uv;
#ifndef SHADOW
out vec3 position_rs;
out vec4 previousClip;
flat out uint flower;
flat out float tint;
#endif

void main() {
    Flower f = flowers[gl_InstanceID];
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    if (f.root.w <= 0.0 || f.root.y < view.clip_below_m) return;
    float v = 0.5 * float(gl_VertexID >> 1), across = float(gl_VertexID & 1) - 0.5;
    vec3 root = f.root.xyz - view.origin_ws.xyz;
    vec3 toEye = view.eye_rs.xyz - root * view.eye_rs.w;
    vec3 side = normalize(cross(f.tip.xyz, toEye) + vec3(1e-6, 0.0, 0.0));
    float depth = dot(view.axis_rs.xyz, root) + view.axis_rs.w, pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
    float width = sign(f.control.w) * max(abs(f.control.w), 2.5 * pixel);
    vec3 offset = across * width * side;
    vec3 position = root + bezierPoint(vec3(0.0), f.control.xyz, f.tip.xyz, v) + offset;
    gl_Position = view.jittered_clip_from_relative * vec4(position, 1.0);
    uv = vec3(across + 0.5, v, float(layer));
#ifndef SHADOW
    position_rs = position;
    vec3 before = root + bezierPoint(vec3(0.0), f.control_before.xyz, f.tip_before.xyz, v) + offset;
    previousClip = view.previous_clip_from_relative * vec4(before, 1.0);
    flower = uint(first_flower + gl_InstanceID);
    tint = f.tip.w;
#endif
}
