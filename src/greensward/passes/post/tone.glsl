// Tone mapping with exposure, averaged over the samples of a picture after the curve, so that bright edges stay clean.
#include "layout/Light"

uniform sampler2D radiance;
uniform sampler2D average;

// Filmic curve with a toe and a long shoulder (Hable 2010, "Filmic Tonemapping Operators")
vec3 hable(vec3 x) {
    const float A = 0.22, B = 0.30, C = 0.10, D = 0.20, E = 0.01, F = 0.30;
    return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F;
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 c = texelFetch(radiance, pixel, 0).rgb * light.exposure;
    vec2 uv = (vec2(pixel) + 0.5) / vec2(textureSize(radiance, 0)) - 0.5;
    c *= 1.0 - light.vignette * smoothstep(0.15, 0.75, length(uv));
    if (light.filmic == 1) {
        // part of the way to grey as light grows, as film does, so that bright colours do not turn to neon
        float bright = dot(c, vec3(0.2126, 0.7152, 0.0722));
        c = mix(c, vec3(bright), 0.35 * smoothstep(1.0, 12.0, bright));
        c = hable(2.0 * c) / hable(vec3(11.2));
    }
    c = mix(vec3(dot(c, vec3(0.2126, 0.7152, 0.0722))), c, light.saturation);
    c = clamp(c, 0.0, 1.0);
#if AVERAGED
    // before the first sample the average holds anything, infinities too
    if (light.sample_index > 0) c = mix(texelFetch(average, pixel, 0).rgb, c, 1.0 / float(light.sample_index + 1));
#endif
    result[0] = vec4(c, 1.0);
    return true;
}
