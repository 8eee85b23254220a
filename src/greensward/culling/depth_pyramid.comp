// Builds three levels of the pyramid from the one below them: each invocation, a texel of the coarsest and all under it.
#include "culling/depth_pyramid.glsl"
#include "culling/base_depth"

layout(local_size_x = 8, local_size_y = 8) in;

uniform int below;

void main() {
    ivec2 whole = pictureSize(), block = ivec2(gl_GlobalInvocationID.xy), sizes[4];
    int starts[4];
    for (int k = 0; k < 4; k++) findLevel(below + k, whole, starts[k], sizes[k]);
    if (any(greaterThanEqual(block, sizes[3]))) return;
    float coarsest = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 quarter = 2 * block + ivec2(i & 1, i >> 1);
        if (any(greaterThanEqual(quarter, sizes[2]))) continue;
        float middle = 0.0;
        for (int j = 0; j < 4; j++) {
            ivec2 texel = 2 * quarter + ivec2(j & 1, j >> 1);
            if (any(greaterThanEqual(texel, sizes[1]))) continue;
            float finest = 0.0;
            for (int k = 0; k < 4; k++) {
                ivec2 p = min(2 * texel + ivec2(k & 1, k >> 1), sizes[0] - 1);
                finest = max(finest, below > 0 ? depth_pyramid[starts[0] + p.y * sizes[0].x + p.x] : baseDepth(p));
            }
            depth_pyramid[starts[1] + texel.y * sizes[1].x + texel.x] = finest;
            middle = max(middle, finest);
        }
        depth_pyramid[starts[2] + quarter.y * sizes[2].x + quarter.x] = middle;
        coarsest = max(coarsest, middle);
    }
    depth_pyramid[starts[3] + block.y * sizes[3].x + block.x] = coarsest;
}
