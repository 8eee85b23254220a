// The pyramid of farthest depths: level 0 is the picture, a texel of level k covers 2^k x 2^k of its pixels.
layout(std430) buffer DepthPyramid { float depth_pyramid[]; };  // levels 1 and up, one after the other

// Odd sizes are rounded up, so that the last texel covers what is left
ivec2 coarser(ivec2 size) { return (size + 1) / 2; }

void findLevel(int level, ivec2 picture, out int start, out ivec2 size) {
    start = 0;
    size = level > 0 ? coarser(picture) : picture;
    for (int k = 1; k < level; k++) {
        start += size.x * size.y;
        size = coarser(size);
    }
}
