// Depth at which the ray of each pixel meets the ground.
#include "ground/march.glsl"
#include "shaders/gbuffer.glsl"

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    result[0] = vec4(march(view.origin_ws.xyz + startOf(pixel), rayThrough(pixel), range_m.x, 0.0));
    return true;
}
