// Bloom: light of bright pixels that a lens spreads over its picture (Derstroff, "Realtime grass", section 3.1): luminance, a
// threshold, a Gaussian filter along each axis, added.
#include "layout/Light"
#include "layout/SkyLight"

uniform sampler2D radiance;

#if defined(BRIGHT)
const float BRIGHTEST = 16.0;  // of exposed light: the sun's disk would outshine all else

// Bright light of a block of texels, exposed
vec3 bright(ivec2 corner, ivec2 size) {
    vec3 sum = vec3(0.0);
    for (int y = 0; y < BLOCK; y++) {
        for (int x = 0; x < BLOCK; x++) {
            vec3 c = texelFetch(radiance, min(corner + ivec2(x, y), size - 1), 0).rgb * skylight.exposure;
            // the source's weights
            float luminance = dot(c, vec3(0.3, 0.59, 0.11));
            if (luminance >= light.bloom_threshold) sum += c * min(1.0, BRIGHTEST / luminance);
        }
    }
    return sum / float(BLOCK * BLOCK);
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    result[0] = vec4(bright(pixel * BLOCK, textureSize(radiance, 0)), 1.0);
    return true;
}
#elif defined(SPREAD)
uniform float sigma_px;

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    ivec2 last = textureSize(radiance, 0) - 1;
    int reach = int(ceil(3.0 * sigma_px));
    vec4 sum = vec4(0.0);
    for (int k = -reach; k <= reach; k++) {
        float weight = exp(-0.5 * float(k * k) / (sigma_px * sigma_px));
        sum += weight * vec4(texelFetch(radiance, clamp(pixel + k * ivec2(ALONG), ivec2(0), last), 0).rgb, 1.0);
    }
    result[0] = vec4(sum.rgb / sum.w, 1.0);
    return true;
}
#else
uniform sampler2D spread;

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec4 c = texelFetch(radiance, pixel, 0);
    vec2 at = (vec2(pixel) + 0.5) / float(BLOCK) / vec2(textureSize(spread, 0));
    result[0] = vec4(c.rgb + light.bloom * textureLod(spread, at, 0.0).rgb / skylight.exposure, c.a);
    return true;
}
#endif
