// Visibility buffer (Burns & Hunt 2013): of what is nearest at each pixel, how near it is and its primitive id, a quad of a blade.
// The larger number is the nearer one, and of two equally near the one of the larger id, so that no order of writing shows.
#include "layout/View"

float depthOfClip(vec4 clip) {
    return view.eye_rs.w > 0.0 ? clip.w : view.parallel_depth_m.x + view.parallel_depth_m.y * clip.z;
}

// Linear on the screen: one over the depth, or in a parallel view the depth below zero; in a shadow map 1 at the near plane to 0 at the far one
float nearnessAt(float depth_m) { return view.eye_rs.w > 0.0 ? 1.0 / depth_m : -depth_m; }

float nearnessOf(vec4 clip) {
#ifdef SHADOW
    return 0.5 - 0.5 * clip.z;
#else
    return nearnessAt(depthOfClip(clip));
#endif
}

float depthOfNearness(float nearness) { return view.eye_rs.w > 0.0 ? 1.0 / nearness : -nearness; }

// Numbers that sort as nearness does: the bits of a positive float do, and inverted those of one below zero without its sign
uint keyOf(float nearness) { return nearness >= 0.0 ? floatBitsToUint(nearness) : ~floatBitsToUint(-nearness); }

float nearnessOfKey(uint key) { return key < 0x80000000u ? uintBitsToFloat(key) : -uintBitsToFloat(~key); }

#ifdef WIDE
layout(std430) coherent buffer VisibilityBuffer { uint64_t visible[]; };
#else
layout(std430) coherent buffer Nearnesses { uint nearnesses[]; };
#ifndef SHADOW
layout(std430) coherent buffer PrimitiveIds { uint primitive_ids[]; };
#endif
#endif

uint pixelIndex(ivec2 pixel) { return uint(pixel.y) * uint(view.size_px.x) + uint(pixel.x); }

void clearVisible(uint pixel_index, float nearness) {
#ifdef WIDE
    visible[pixel_index] = packUint2x32(uvec2(0u, keyOf(nearness)));
#else
    nearnesses[pixel_index] = keyOf(nearness);
#ifndef SHADOW
    primitive_ids[pixel_index] = 0u;
#endif
#endif
}

#ifndef SHADOW
uint readVisible(uint pixel_index, out float nearness) {
#ifdef WIDE
    uvec2 halves = unpackUint2x32(visible[pixel_index]);
    nearness = nearnessOfKey(halves.y);
    return halves.x;
#else
    nearness = nearnessOfKey(nearnesses[pixel_index]);
    return primitive_ids[pixel_index];
#endif
}
#endif
