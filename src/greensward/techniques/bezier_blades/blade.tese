// Curves the quad: De Casteljau along v, the outline across u.
#include "shaders/bezier.glsl"
#include "layout/BladeRecord"
#include "shaders/blade.glsl"
#include "techniques/blades/outlines.glsl"
#include "techniques/blades/normal.glsl"
#include "layout/View"
#include "techniques/blades/material.glsl"

layout(quads, equal_spacing, ccw) in;

layout(std430) readonly buffer Records { BladeRecord records[]; };

patch in uint record;

#ifndef SHADOW
out vec4 normalAndHeight;    // w runs from 0 at the root to 1 at the tip
out vec3 previousClip;       // x, y, w
flat out uint shown;         // the record

uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space
#endif

void main() {
    float u = gl_TessCoord.x, v = gl_TessCoord.y;
    BladeRecord r = records[record];
    vec3 root = vec3(r.x, r.y, r.z), control, tip;
    unpackPose(r.now, root, control, tip);
    int kind = int(unpackHalf2x16(r.level_and_shape).y + 0.5);
    vec3 side = octahedralDecode(unpackSnorm2x16(r.side));
    vec3 centre = bezierPoint(root, control, tip, v);
    vec3 tangent = normalize(bezierTangent(root, control, tip, v));
    float depth = dot(view.axis_rs.xyz, centre) + view.axis_rs.w;
    float widthPx = r.width / (view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y);
    float across = shapeParameter(kind, u, v, widthPx) - 0.5;
    vec3 outward = cross(side, tangent);
    vec3 offset = r.width * (across * side + shapeFold(kind, u, v) * outward);
    gl_Position = view.jittered_clip_from_relative * vec4(centre + offset, 1.0);

#ifndef SHADOW
    vec3 position_rs = centre + offset;
    vec3 previousControl, previousTip;
    unpackPose(r.previous, root, previousControl, previousTip);
    vec4 previous_rs = previous_from_now * vec4(bezierPoint(root, previousControl, previousTip, v) + offset, 1.0);
    previousClip = (view.previous_clip_from_relative * previous_rs).xyw;

    vec3 toEye = view.eye_rs.xyz - position_rs * view.eye_rs.w;
    vec3 wall = octahedralDecode(unpackSnorm2x16(r.wall)), trueSide = octahedralDecode(unpackSnorm2x16(r.true_side));
    vec4 shading = unpackUnorm4x8(r.shading);
    tangent = normalize(bezierTangent(root, control, tip, higher(v, shading.z, TURNED)));
    normalAndHeight = vec4(leafNormal(trueSide, side, tangent, toEye, u, wall, shading.y), v);
    shown = record;
#endif
}
