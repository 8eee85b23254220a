// How finely a blade is cut, whether it is left out, and the control point that bends it.
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "culling/tests.glsl"
#include "layout/Sward"

layout(vertices = 1) out;

#ifndef SHADOW
layout(std430) buffer Drawn { uint drawn[]; };  // blades, summed in 1,024 parts
#endif

uniform float thinning;
uniform bool by_size;
uniform float px_per_quad;

in Outlined blade[];

patch out Outlined bent;
patch out vec3 bend;  // control point of the middle, from the root

void main() {
    Outlined b = blade[0];
    float away = distance(b.root + view.origin_ws.xyz, view.camera_ws.xyz), level = 0.0, fade = 1.0;
    if (b.shape.z > 0.0) {
        // Section 6.3: more blades are left out the farther they are, at random
        float share = 1.0 - thinning * min(away / sward.reach_m, 1.0);
        fade = thinning > 0.0 ? clamp((share * (1.0 + FADING) - b.shape.w) / FADING, 0.0, 1.0) : 1.0;
        level = levelByDistance(b.shape.z, away, sward.reach_m);
        if (by_size && level > 0.0) {
            vec4 low = view.clip_from_relative * vec4(b.root, 1.0), high = view.clip_from_relative * vec4(b.root + b.tip, 1.0);
            level = levelBySize(b.shape.z, high.y / max(high.w, 1e-3), low.y / max(low.w, 1e-3), view.size_px.y, px_per_quad);
        }
    }
    b.side *= fade;
    bent = b;
    bend = controlPoint(vec3(0.0), b.tip, b.up, b.shape.xy);
    if (fade <= 0.0) level = 0.0;
#ifdef FRUSTUM
    else if (outside(b.root, b.root + bend, b.root + b.tip, length(b.side))) level = 0.0;
#endif
    gl_TessLevelOuter[0] = gl_TessLevelOuter[2] = level;
    gl_TessLevelOuter[1] = gl_TessLevelOuter[3] = min(level, 1.0);
    gl_TessLevelInner[0] = 1.0;
    gl_TessLevelInner[1] = level;
#ifndef SHADOW
    if (level > 0.0) atomicAdd(drawn[b.numberAndSpecies.x & 1023u], 1u);
#endif
}
