#include "layout/View"
#include "techniques/visibility_buffer/squares.glsl"

void main() {
    uint square = squares[gl_InstanceID];
    ivec2 corner = ivec2(square & 0xffffu, square >> 16u) + SQUARE * ivec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(vec2(corner) * view.size_px.zw * 2.0 - 1.0, 0.0, 1.0);
}
