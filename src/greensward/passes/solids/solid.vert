#include "block/View"

in vec3 corner;
in vec3 normal;
in vec4 row0;
in vec4 row1;
in vec4 row2;
in vec4 paint;
in vec4 extent;

out vec3 position_ws;
out vec3 local;
out vec3 normal_ws;
flat out vec4 colour;

void main() {
    mat3 linear = transpose(mat3(row0.xyz, row1.xyz, row2.xyz));
    position_ws = linear * corner + vec3(row0.w, row1.w, row2.w);
    normal_ws = linear * (normal / (extent.xyz * extent.xyz));
    local = corner * extent.xyz;
    colour = paint;
    gl_Position = view.jittered_clip_from_world * vec4(position_ws, 1.0);
}
