// The finished picture into a caller's framebuffer, with its depth.
layout(binding = 10) uniform sampler2D picture;
layout(binding = 14) uniform sampler2D gDepth;

uniform vec2 depthScale;

out vec4 colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth_m = texelFetch(gDepth, pixel, 0).r;
    gl_FragDepth = isinf(depth_m) ? 1.0 : clamp(depthScale.x + depthScale.y / depth_m, 0.0, 1.0);
    colour = vec4(texelFetch(picture, pixel, 0).rgb, 1.0);
}
