// Depth of the grid in a shadow map: parallel rays from the sun.
#include "techniques/billboard_grid/trace.glsl"

uniform mat4 relative_from_clip;

void main() {
    vec2 at = gl_FragCoord.xy * view.size_px.zw * 2.0 - 1.0;
    vec4 near = relative_from_clip * vec4(at, -1.0, 1.0), far = relative_from_clip * vec4(at, 1.0, 1.0);
    vec3 way = far.xyz - near.xyz;
    Traced t;
    Around a;
    if (!trace(uvec2(gl_FragCoord.xy), near.xyz, normalize(way), NOWHERE_M, false, t, a)) discard;
    gl_FragDepth = t.depth_m / length(way);
}
