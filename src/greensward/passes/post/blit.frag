// The finished picture into a caller's framebuffer, with its depth.
#include "shaders/gbuffer.glsl"

uniform sampler2D picture;

uniform vec2 depth_scale;

out vec4 colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth_m = depthAt(pixel);
    gl_FragDepth = isinf(depth_m) ? 1.0 : clamp(depth_scale.x + depth_scale.y / depth_m, 0.0, 1.0);
    colour = vec4(texelFetch(picture, pixel, 0).rgb, 1.0);
}
