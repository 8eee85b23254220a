// Lists the squares of the picture that show a blade of this page: a CPU driver runs resolve.frag for every pixel that is
// drawn, so others must not be.
#include "techniques/visibility_buffer/visibility.glsl"
#include "techniques/visibility_buffer/squares.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform uint first_primitive_id;
uniform uint blade_count;

void main() {
    ivec2 size = ivec2(view.size_px.xy), first = SQUARE * ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(first, size))) return;
    ivec2 end = min(first + SQUARE, size);
    bool shown = false;
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            float nearness;
            shown = shown || (readVisible(pixelIndex(ivec2(x, y)), nearness) - first_primitive_id) >> 5u < blade_count;
        }
    }
    if (shown) squares[atomicAdd(square_command.instances, 1u)] = uint(first.y) << 16u | uint(first.x);
}
