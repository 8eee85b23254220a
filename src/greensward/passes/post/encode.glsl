// SRGB encoding in eight bits, dithered by half a step against banding in the sky.
#include "shaders/hash.glsl"

uniform sampler2D picture;

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 c = texelFetch(picture, pixel, 0).rgb;
#ifdef CUT_OUT
    float part = texelFetch(picture, pixel, 0).a;
    c /= max(part, 1e-6);
#else
    float part = 1.0;
#endif
    vec3 srgb = mix(12.92 * c, 1.055 * pow(max(c, 1e-6), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    vec3 noise = unit(hash3(uvec3(uvec2(pixel), 7u))) - unit(hash3(uvec3(uvec2(pixel), 8u)));
    result[0] = part * vec4(srgb + 0.5 * noise / 255.0, 1.0);
    return true;
}
