// Visibility buffer (Burns & Hunt 2013): of what is nearest at each pixel, inverse depth and primitive id, a quad of a blade.
// The larger number is the nearer one, and of two equally near the one of the larger id, so that no order of writing shows.
#include "layout/View"

// Bits of a positive float sort as the float does. Linear on the screen: one over the depth, or in a parallel view 1 at the
// near plane to 0 at the far one.
float inverseDepthOf(vec4 clip) {
#ifdef SHADOW
    return 0.5 - 0.5 * clip.z;
#else
    return 1.0 / clip.w;
#endif
}

#ifdef WIDE
layout(std430) coherent buffer VisibilityBuffer { uint64_t visible[]; };
#else
layout(std430) coherent buffer InverseDepths { uint inverse_depths[]; };
#ifndef SHADOW
layout(std430) coherent buffer PrimitiveIds { uint primitive_ids[]; };
#endif
#endif

uint pixelIndex(ivec2 pixel) { return uint(pixel.y) * uint(view.size_px.x) + uint(pixel.x); }

void clearVisible(uint pixel_index, float inverse_depth) {
#ifdef WIDE
    visible[pixel_index] = packUint2x32(uvec2(0u, floatBitsToUint(inverse_depth)));
#else
    inverse_depths[pixel_index] = floatBitsToUint(inverse_depth);
#ifndef SHADOW
    primitive_ids[pixel_index] = 0u;
#endif
#endif
}

#ifndef SHADOW
uint readVisible(uint pixel_index, out float inverse_depth) {
#ifdef WIDE
    uvec2 halves = unpackUint2x32(visible[pixel_index]);
    inverse_depth = uintBitsToFloat(halves.y);
    return halves.x;
#else
    inverse_depth = uintBitsToFloat(inverse_depths[pixel_index]);
    return primitive_ids[pixel_index];
#endif
}
#endif
