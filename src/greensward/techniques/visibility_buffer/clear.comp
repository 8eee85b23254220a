// Empties the cells: nothing but what the picture shows already, or in a shadow map nothing at all.
#include "techniques/visibility_buffer/cells.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

#ifndef SHADOW
layout(binding = 14) uniform sampler2D gDepth;

layout(std430, binding = 10) writeonly buffer Drawn { uint drawn[]; };

uniform float farthest_m;
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
#ifndef SHADOW
    if (gl_LocalInvocationIndex == 0u) {
        uint number = gl_WorkGroupID.x + gl_NumWorkGroups.x * gl_WorkGroupID.y;
        for (; number < 1024u; number += gl_NumWorkGroups.x * gl_NumWorkGroups.y) drawn[number] = 0u;
    }
#endif
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy)))) return;
#ifdef SHADOW
    clearCell(cellOf(pixel), 0.0);
#else
    clearCell(cellOf(pixel), 1.0 / min(texelFetch(gDepth, pixel, 0).r, farthest_m));
#endif
}
