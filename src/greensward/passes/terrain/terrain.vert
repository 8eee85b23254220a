// Geometry clipmap of the ground in shadow maps (Losasso & Hoppe 2004): nested grids around the camera, each twice as coarse.
#include "ground/ground.glsl"
#include "layout/View"

in vec2 corner;      // in cells from the middle
uniform float finest;  // spacing of level 0, metres
uniform int first_level;

void main() {
    float spacing = finest * exp2(float(first_level + gl_InstanceID));
    // even multiples keep coarse vertices on fine ones as the camera moves
    vec2 middle = round(view.camera_ws.xz / (2.0 * spacing)) * 2.0 * spacing;
    vec2 xz = middle + corner * spacing;
    vec3 position_ws = vec3(xz.x, groundHeight(xz), xz.y);
    gl_Position = view.jittered_clip_from_relative * vec4(position_ws - view.origin_ws.xyz, 1.0);
}
