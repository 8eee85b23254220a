// Depth of the grid in a shadow map, 0 to 1: parallel rays from the sun, one for every COARSER x COARSER texels.
#include "techniques/billboard_grid/trace.glsl"

uniform mat4 relative_from_clip;

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec2 at = (vec2(pixel) + 0.5) * float(COARSER) * view.size_px.zw * 2.0 - 1.0;
    vec4 near = relative_from_clip * vec4(at, -1.0, 1.0), far = relative_from_clip * vec4(at, 1.0, 1.0);
    vec3 direction = far.xyz - near.xyz;
    Traced t;
    Around a;
    bool meets = trace(uvec2(pixel), near.xyz, normalize(direction), NOWHERE_M, false, t, a);
    result[0] = vec4(meets ? t.depth_m / length(direction) : 1.0);
    return true;
}
