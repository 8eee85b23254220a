// Depth that culling/depth_pyramid.comp builds on: that of what the visibility buffer shows so far.
#include "techniques/visibility_buffer/visibility.glsl"

ivec2 pictureSize() { return ivec2(view.size_px.xy); }

float baseDepth(ivec2 pixel) {
    float nearness;
    readVisible(pixelIndex(pixel), nearness);
    return depthOfNearness(nearness);
}
