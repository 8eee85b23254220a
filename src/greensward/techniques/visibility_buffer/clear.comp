// Empties the visibility buffer: nothing but what the picture shows already, or in a shadow map nothing at all.
#include "techniques/visibility_buffer/visibility.glsl"
#include "techniques/visibility_buffer/lists.glsl"
#include "shaders/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
#ifndef SHADOW
    if (gl_WorkGroupID.xy == uvec2(0u)) {
        for (uint i = gl_LocalInvocationIndex; i < uint(lists.drawn.length()); i += 64u) lists.drawn[i] = 0u;
    }
#endif
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy)))) return;
#ifdef SHADOW
    clearVisible(pixelIndex(pixel), 0.0);
#else
    clearVisible(pixelIndex(pixel), nearnessAt(min(depthAt(pixel), view.range_m.y)));
#endif
}
