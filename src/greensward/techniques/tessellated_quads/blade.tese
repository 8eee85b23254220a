// Bends the quad: each edge is a spline, and a point of the blade lies between both.
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "techniques/blades/material.glsl"
#include "techniques/blades/normal.glsl"
#include "shaders/octahedral.glsl"
#include "layout/View"

layout(quads, equal_spacing, ccw) in;

patch in Outlined bent;
patch in vec3 bend;

#ifndef SHADOW
out vec3 normal_ws;
out vec3 previousClip;  // x, y, w
flat out uvec4 material;

uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space
#endif
out vec2 uv;
flat out uvec2 numberAndSpecies;

Point pointAt(vec3 tip, vec3 control, float u, float v) {
    vec3 left = bent.root - 0.5 * bent.side, right = bent.root + 0.5 * bent.side, tangentLeft, tangentRight;
    vec3 onLeft = spline(left, left + control, left + tip, v, tangentLeft);
    vec3 onRight = spline(right, right + control, right + tip, v, tangentRight);
    return pointOn(onLeft, tangentLeft, onRight, tangentRight, u);
}

void main() {
    uv = gl_TessCoord.xy;
    numberAndSpecies = bent.numberAndSpecies;
    Point p = pointAt(bent.tip, bend, uv.x, uv.y);
    gl_Position = view.jittered_clip_from_relative * vec4(p.position, 1.0);
#ifndef SHADOW
    material = bent.material;
    vec3 bendBefore = controlPoint(vec3(0.0), bent.before, bent.up, bent.shape.xy);
    Point before = pointAt(bent.before, bendBefore, uv.x, uv.y);
    previousClip = (view.previous_clip_from_relative * (previous_from_now * vec4(before.position, 1.0))).xyw;
    vec3 toEye = view.eye_rs.xyz - p.position * view.eye_rs.w;
    vec3 wall = octahedralDecode(unpackSnorm2x16(bent.material.w));
    vec4 place = unpackUnorm4x8(bent.material.z);
    // towards the tip where one blade stands for many
    vec3 tangent = place.z < 0.99 ? pointAt(bent.tip, bend, uv.x, higher(uv.y, place.z, TURNED)).tangent : p.tangent;
    normal_ws = leafNormal(bent.trueSide, p.bitangent, tangent, toEye, uv.x, wall, place.y);
#endif
}
