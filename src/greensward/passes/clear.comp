// Empties the G-buffer: sky, infinitely far.
layout(local_size_x = 8, local_size_y = 8) in;

layout(rg32ui) writeonly uniform uimage2D surface_image;

void main() {
    // nothing is written outside the picture
    imageStore(surface_image, ivec2(gl_GlobalInvocationID.xy), uvec4(0u, 0x7f800000u, 0u, 0u));
}
