// Bends the quad: each edge is a spline, and a point of the blade lies between both.
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "techniques/blades/material.glsl"
#include "techniques/blades/normal.glsl"
#include "shaders/octahedral.glsl"
#include "layout/View"

layout(quads, equal_spacing, ccw) in;

patch in Outlined bent;
patch in vec3 bend[2];

#ifndef SHADOW
out vec3 normal_ws;
out vec3 previousClip;  // x, y, w
flat out uvec4 material;

uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space
#endif
out vec2 uv;
flat out uvec3 identity;

// Equations 7 and 8 on the edges from the corners of a quad
struct Edges { vec3 left, right, tangentLeft, tangentRight; };

Edges edgesAt(vec3 corners[4], vec3 control[2], float v) {
    Edges e;
    e.left = spline(corners[0], control[0], corners[3], v, e.tangentLeft);
    e.right = spline(corners[1], control[1], corners[2], v, e.tangentRight);
    return e;
}

Point pointAt(Edges e, float u) { return pointOn(e.left, e.tangentLeft, e.right, e.tangentRight, u); }

#ifndef SHADOW
vec3 positionBefore() {
    vec3 corners[4] = bent.corners, control[2];
    corners[2] = corners[1] + bent.before;
    corners[3] = corners[0] + bent.before;
    for (int k = 0; k < 2; k++) control[k] = controlPoint(corners[k], corners[3 - k], bent.up, bent.shape.xy);
    return pointAt(edgesAt(corners, control, uv.y), uv.x).position;
}

// The normal of equation 8, as if the blade were not turned to the viewer
vec3 trueNormal(float v) {
    Edges e = edgesAt(bent.corners, bend, v);
    e.right = e.left + bent.trueSide;
    return pointAt(e, uv.x).normal;
}
#endif

void main() {
    uv = gl_TessCoord.xy;
    identity = bent.identity;
    Point p = pointAt(edgesAt(bent.corners, bend, uv.y), uv.x);
    gl_Position = view.jittered_clip_from_relative * vec4(p.position, 1.0);
#ifndef SHADOW
    material = bent.material;
    previousClip = (view.previous_clip_from_relative * (previous_from_now * vec4(positionBefore(), 1.0))).xyw;
    vec3 toEye = view.eye_rs.xyz - p.position * view.eye_rs.w;
    vec3 wall = octahedralDecode(unpackSnorm2x16(bent.material.w));
    vec4 place = unpackUnorm4x8(bent.material.z);
#ifdef SHADED_ALONE
    normal_ws = mix(towards(toEye, trueNormal(uv.y)), wall, place.y);
#else
    // towards the tip where one blade stands for many
    vec3 normal = trueNormal(place.z < 0.99 ? higher(uv.y, place.z, TURNED) : uv.y);
    normal_ws = roundedNormal(normal, bent.trueSide, p.bitangent, toEye, uv.x, wall, place.y);
#endif
#endif
}
