#include "ground/ground.glsl"
#include "block/View"

in vec2 corner;
uniform vec4 grid;  // middle x and z, spacing

out vec3 position_ws;

void main() {
    vec2 xz = grid.xy + corner * grid.z;
    position_ws = vec3(xz.x, groundHeight(xz), xz.y);
    gl_Position = view.jittered_clip_from_world * vec4(position_ws, 1.0);
}
