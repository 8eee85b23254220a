// Counts the pixels that show a blade, in squares of 8 x 8, each by itself.
#include "shaders/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(std430) writeonly buffer Counts { uint counts[]; };

void main() {
    ivec2 size = textureSize(gbuffer_surface, 0), squares = (size + 7) / 8, square = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(square, squares))) return;
    ivec2 first = 8 * square, end = min(first + 8, size);
    uint count = 0u;
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            uvec2 surface = texelFetch(gbuffer_surface, ivec2(x, y), 0).rg;
            if (surfaceClassOf(surface) == CLASS_GRASS && bladeNumberOf(surface) != 0u) count++;
        }
    }
    counts[square.y * squares.x + square.x] = count;
}
