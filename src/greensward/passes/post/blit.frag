// The finished picture into a host's framebuffer, with its depth.
#include "shaders/gbuffer.glsl"

uniform sampler2D picture;
#ifdef CUT_OUT
uniform sampler2D shown_depth;
#endif

uniform vec2 depth_scale;
uniform float sky_depth;
uniform ivec2 corner_px;

layout(location = 0) out vec4 colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - corner_px;
    colour = texelFetch(picture, pixel, 0);
#ifdef CUT_OUT
    if (colour.a == 0.0) discard;
    float depth_m = texelFetch(shown_depth, pixel, 0).r;
#else
    colour.a = 1.0;
    float depth_m = depthAt(pixel);
#endif
    float scaled = depth_scale.x + depth_scale.y * (view.eye_rs.w > 0.0 ? 1.0 / depth_m : depth_m);
    gl_FragDepth = isinf(depth_m) ? sky_depth : clamp(scaled, 0.0, 1.0);
}
