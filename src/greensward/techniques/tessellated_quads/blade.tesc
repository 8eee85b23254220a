// How finely a blade is cut, whether it is left out, and the control point that bends it.
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "culling/tests.glsl"
#include "techniques/tessellated_quads/thinning.glsl"

layout(vertices = 1) out;

#ifndef SHADOW
layout(std430) buffer Drawn { uint drawn[]; };  // blades, summed in 1,024 parts
#endif

uniform int measure;  // of the level: distance, size, length
uniform float px_per_quad;

in Outlined blade[];

patch out Outlined bent;
patch out vec3 bend[2];  // control points of the left and the right edge

float levelOf(Outlined b, float away) {
    float level = levelByDistance(b.shape.z, away, sward.reach_m);
    if (measure == 0 || level <= 0.0) return level;
    vec3 lower = 0.5 * (b.corners[0] + b.corners[1]), upper = 0.5 * (b.corners[2] + b.corners[3]);
    vec4 low = view.clip_from_relative * vec4(lower, 1.0), high = view.clip_from_relative * vec4(upper, 1.0);
    vec2 l = low.xy / max(low.w, 1e-3), u = high.xy / max(high.w, 1e-3);
    return measure == 1 ? levelBySize(b.shape.z, u.y, l.y, view.size_px.y, px_per_quad)
                        : levelByLength(b.shape.z, u, l, view.size_px.xy, px_per_quad);
}

// Leaves the middle of each edge where it is
void narrow(inout vec3 corners[4], float part) {
    vec3 left = 0.5 * (1.0 - part) * (corners[1] - corners[0]);
    corners[0] += left;
    corners[1] -= left;
    corners[2] -= left;
    corners[3] += left;
}

void main() {
    Outlined b = blade[0];
    vec3 root = 0.5 * (b.corners[0] + b.corners[1]);
    float away = distance(root + view.origin_ws.xyz, view.camera_ws.xyz), level = 0.0, fade = 1.0;
    if (b.shape.z > 0.0) {
        fade = thinning > 0.0 ? clamp((partOfBlades(away) * (1.0 + FADING) - b.shape.w) / FADING, 0.0, 1.0) : 1.0;
        level = levelOf(b, away);
    }
    narrow(b.corners, fade);
    bent = b;
    bend[0] = controlPoint(b.corners[0], b.corners[3], b.up, b.shape.xy);
    bend[1] = controlPoint(b.corners[1], b.corners[2], b.up, b.shape.xy);
    if (fade <= 0.0) level = 0.0;
#ifdef FRUSTUM
    else if (outside(root, 0.5 * (bend[0] + bend[1]), 0.5 * (b.corners[2] + b.corners[3]), length(b.corners[1] - b.corners[0]))) level = 0.0;
#endif
    gl_TessLevelOuter[0] = gl_TessLevelOuter[2] = level;
    gl_TessLevelOuter[1] = gl_TessLevelOuter[3] = min(level, 1.0);
    gl_TessLevelInner[0] = 1.0;
    gl_TessLevelInner[1] = level;
#ifndef SHADOW
    if (level > 0.0) atomicAdd(drawn[b.identity.x & 1023u], 1u);
#endif
}
