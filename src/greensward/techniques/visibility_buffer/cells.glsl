// What is nearest at each pixel: how near, and which quad of which blade. The larger number is the nearer one, and of two
// equally near the one of the larger name, so that no order of writing shows in the picture.
#include "block/View"

// Bits of a positive float sort as the float does. Linear on the screen: the inverse depth, or in a parallel view the
// nearness from 0 to 1.
float nearnessOf(vec4 clip) {
#ifdef SHADOW
    return 0.5 - 0.5 * clip.z;
#else
    return 1.0 / clip.w;
#endif
}

#ifdef WIDE
layout(std430, binding = 5) coherent buffer Cells { uint64_t cells[]; };
#else
layout(std430, binding = 5) coherent buffer Nearest { uint nearest[]; };
#ifndef SHADOW
layout(std430, binding = 6) coherent buffer Names { uint names[]; };
#endif
#endif

uint cellOf(ivec2 pixel) { return uint(pixel.y) * uint(view.size_px.x) + uint(pixel.x); }

void clearCell(uint cell, float nearness) {
#ifdef WIDE
    cells[cell] = packUint2x32(uvec2(0u, floatBitsToUint(nearness)));
#else
    nearest[cell] = floatBitsToUint(nearness);
#ifndef SHADOW
    names[cell] = 0u;
#endif
#endif
}

#ifndef SHADOW
uint readCell(uint cell, out float nearness) {
#ifdef WIDE
    uvec2 halves = unpackUint2x32(cells[cell]);
    nearness = uintBitsToFloat(halves.y);
    return halves.x;
#else
    nearness = uintBitsToFloat(nearest[cell]);
    return names[cell];
#endif
}
#endif
