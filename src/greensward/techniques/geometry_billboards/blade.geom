// A billboard for each root: segments one above the other, turned to the camera, each sheared by its share of the force
// (Derstroff 2024, sections 2.1, 2.2 and 2.4).
#include "techniques/geometry_billboards/rooted.glsl"
#include "techniques/geometry_billboards/bend.glsl"
#include "layout/View"
#ifndef SHADOW
#include "techniques/blades/normal.glsl"
#include "shaders/octahedral.glsl"
#endif

layout(points) in;
layout(triangle_strip, max_vertices = VERTICES) out;

in Rooted rooted[];

uniform int segments;

out vec2 uv;  // from the upper left
flat out uvec2 numberAndTexture;
#ifndef SHADOW
out vec3 normal_ws;
out vec3 previousClip;  // x, y, w
flat out uvec4 material;
flat out uint dry;
#ifdef TUBE
out vec3 toViewer;
flat out vec3 across;
out vec3 stoodOut;      // what standing out by the radius adds to previousClip
out vec2 nearer;        // and to depth in the buffer, and in metres
#endif
#endif

vec3 pointAt(vec2 force, float h) { return bent(rooted[0].root + vec3(0.0, rooted[0].shape.x * h, 0.0), force, h); }

#ifdef TUBE
// The depth range is the usual one, or reversed from 1 to 0, in which case the matrix to draw with is another
void standOut(vec3 p, float radius) {
    mat4 drawn = view.jittered_clip_from_relative, usual = view.clip_from_relative;
    bool same = drawn[2].z == usual[2].z && drawn[3].z == usual[3].z;
    vec3 moved = p + radius * toViewer;
    vec4 from = drawn * vec4(p, 1.0), to = drawn * vec4(moved, 1.0);
    nearer = vec2((same ? 0.5 : 1.0) * (to.z / max(to.w, 1e-4) - from.z / max(from.w, 1e-4)), dot(view.axis_rs.xyz, moved - p));
    stoodOut = (view.previous_clip_from_relative * vec4(radius * toViewer, 0.0)).xyw;
}
#endif

void corner(vec3 p, vec3 before, vec3 along, vec3 side, float u, float h) {
    uv = vec2(u, 1.0 - h);
    numberAndTexture = rooted[0].numberAndTexture;
    vec3 offset = (u - 0.5) * rooted[0].shape.y * side;
    p += offset;
    gl_Position = view.jittered_clip_from_relative * vec4(p, 1.0);
#ifndef SHADOW
    material = rooted[0].material;
    dry = rooted[0].dry;
    previousClip = (view.previous_clip_from_relative * vec4(before + offset, 1.0)).xyw;
    vec3 toEye = view.eye_rs.xyz - p * view.eye_rs.w, trueSide = normalize(rooted[0].side - along * dot(rooted[0].side, along) / dot(along, along));
    float far = unpackUnorm2x16(material.z).y;
    normal_ws = leafNormal(trueSide, side, normalize(along), toEye, u, octahedralDecode(unpackSnorm2x16(material.w)), far);
#ifdef TUBE
    across = side;
    toViewer = normalize(toEye);
    standOut(p, 0.5 * rooted[0].shape.y);
#endif
#endif
    EmitVertex();
}

void main() {
    float tall = rooted[0].shape.x;
    if (tall <= 0.0) return;
    vec2 now = rooted[0].force.xy, ago = rooted[0].force.zw;
    vec3 middle = pointAt(now, 0.5), viewer = normalize(view.eye_rs.xyz - middle * view.eye_rs.w);
    vec3 side = acrossBillboard(rightOf(view.clip_from_relative), normalize(pointAt(now, 1.0) - rooted[0].root), viewer);
    for (int i = 0; i <= segments; i++) {
        float h = float(i) / float(segments);
        vec3 p = pointAt(now, h), before = pointAt(ago, h), along = bentAlong(tall, now, h);
        corner(p, before, along, side, 0.0, h);
        corner(p, before, along, side, 1.0, h);
    }
    EndPrimitive();
}
