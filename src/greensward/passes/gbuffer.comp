// Counts the pixels that show a blade, in squares of 8 x 8, each by itself.
#include "shaders/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, binding = 0) writeonly buffer Counts { uint counts[]; };

void main() {
    ivec2 size = textureSize(gId, 0), squares = (size + 7) / 8, square = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(square, squares))) return;
    ivec2 first = 8 * square, end = min(first + 8, size);
    uint count = 0u;
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            uint id = texelFetch(gId, ivec2(x, y), 0).r;
            if (id >> 27u == CLASS_GRASS && (id & 0x7FFFFFFu) != 0u) count++;
        }
    }
    counts[square.y * squares.x + square.x] = count;
}
