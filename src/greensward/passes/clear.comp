// Empties the G-buffer: sky, infinitely far.
layout(local_size_x = 8, local_size_y = 8) in;

layout(r32ui, binding = 3) writeonly uniform uimage2D idImage;
layout(r32f, binding = 4) writeonly uniform image2D depthImage;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    imageStore(idImage, pixel, uvec4(0u));  // nothing is written outside the picture
    imageStore(depthImage, pixel, vec4(uintBitsToFloat(0x7f800000u)));
}
