// What culling/pyramid.comp builds on: the depth of what the cells show so far.
#include "techniques/visibility_buffer/cells.glsl"

ivec2 pictureSize() { return ivec2(view.size_px.xy); }

float depthOf(ivec2 pixel) {
    float nearness;
    readCell(cellOf(pixel), nearness);
    return 1.0 / nearness;
}
