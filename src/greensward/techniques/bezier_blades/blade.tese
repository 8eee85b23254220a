// Curves the quad: De Casteljau along v, the outline across u.
#include "shaders/bezier.glsl"
#include "techniques/bezier_blades/shapes.glsl"
#include "block/View"
#include "block/BezierBlades"

layout(quads, equal_spacing, ccw) in;

patch in vec3 root;
patch in vec3 control;
patch in vec3 tip;
patch in vec3 side;
patch in float width;
patch in float shape;
#ifndef SHADOW
patch in vec3 previousControl;
patch in vec3 previousTip;
patch in vec3 trueSide;
patch in vec3 rootColour;
patch in vec3 tipColour;
patch in vec4 look;
patch in vec3 groundNormal_ws;
patch in uint bladeIndex;

out vec3 colour;
out vec3 normal_ws;
out vec3 gloss;          // transmittance, roughness, occlusion
out vec4 previousClip;
flat out uint blade;
#endif

void main() {
    float u = gl_TessCoord.x, v = gl_TessCoord.y;
    int kind = int(shape + 0.5);
    vec3 centre = bezierPoint(root, control, tip, v);
    vec3 tangent = normalize(bezierTangent(root, control, tip, v));
    float depth = dot(view.axis_ws.xyz, centre) + view.axis_ws.w;
    float widthPx = width / (view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y);
    float across = shapeParameter(kind, u, v, widthPx) - 0.5;
    vec3 outward = cross(side, tangent);
    vec3 offset = width * (across * side + shapeFold(kind, u, v) * outward);
    gl_Position = view.jittered_clip_from_world * vec4(centre + offset, 1.0);

#ifndef SHADOW
    vec3 position_ws = centre + offset;
    previousClip = view.previous_clip_from_world
        * vec4(bezierPoint(root, previousControl, previousTip, v) + offset, 1.0);

    // round, not flat: the normal turns across the blade; far away it follows the ground and stops sparkling
    vec3 flatNormal = normalize(cross(trueSide, tangent));
    vec3 toViewer = normalize(view.eye_ws.xyz - position_ws * view.eye_ws.w);
    if (dot(flatNormal, toViewer) < 0.0) flatNormal = -flatNormal;
    float turn = 1.9 * bezierblades.roundness * (u - 0.5) * (dot(side, trueSide) < 0.0 ? -1.0 : 1.0);
    normal_ws = normalize(flatNormal + turn * trueSide);
    vec3 wall = normalize(0.8 * normalize(toViewer - groundNormal_ws * dot(toViewer, groundNormal_ws)) + 0.75 * groundNormal_ws);
    normal_ws = normalize(mix(normal_ws, wall, 0.8 * look.w));

    colour = mix(rootColour, tipColour, smoothstep(0.0, 0.85, v));
    float height = clamp(look.z * v, 0.0, 1.0);
    gloss = vec3(look.x * mix(0.45, 1.0, v), look.y, mix(mix(0.12, 0.8, look.w), 1.0, height * (2.0 - height)));
    blade = bladeIndex;
#endif
}
