// Tone mapping with exposure, averaged over the samples of a picture after the curve, so that bright edges stay clean.
#include "layout/Light"
#include "layout/SkyLight"
#ifdef CUT_OUT
#include "shaders/gbuffer.glsl"

uniform sampler2D shown_depth;  // nearest of the samples before, in metres
uniform uint hidden;            // bits of classes that are left out
#endif

uniform sampler2D radiance;
uniform sampler2D average;

// Filmic curve with a toe and a long shoulder (Hable 2010, "Filmic Tonemapping Operators")
vec3 hable(vec3 x) {
    const float A = 0.22, B = 0.30, C = 0.10, D = 0.20, E = 0.01, F = 0.30;
    return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F;
}

vec3 toned(ivec2 pixel, vec3 c) {
    vec2 uv = (vec2(pixel) + 0.5) / vec2(textureSize(radiance, 0)) - 0.5;
    c *= 1.0 - light.vignette * smoothstep(0.15, 0.75, length(uv));
    if (light.filmic == 1) {
        // part of the way to grey as light grows, as film does, so that bright colours do not turn to neon
        float bright = dot(c, vec3(0.2126, 0.7152, 0.0722));
        c = mix(c, vec3(bright), 0.35 * smoothstep(1.0, 12.0, bright));
        c = hable(2.0 * c) / hable(vec3(11.2));
    }
    c = mix(vec3(dot(c, vec3(0.2126, 0.7152, 0.0722))), c, light.saturation);
    return clamp(c, 0.0, 1.0);
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 c = texelFetch(radiance, pixel, 0).rgb;
#ifndef RADIANCE
    c = toned(pixel, c * skylight.exposure);
#endif
    result[0] = vec4(c, 1.0);
#ifdef CUT_OUT
    bool shows = (hidden >> classAt(pixel) & 1u) == 0u;
    result[0] *= float(shows);
    result[1] = vec4(shows ? depthAt(pixel) : 1e30, 0.0, 0.0, 0.0);
#endif
#if AVERAGED
    // before the first sample the averages hold anything, infinities too
    if (light.sample_index > 0) {
        result[0] = mix(texelFetch(average, pixel, 0), result[0], 1.0 / float(light.sample_index + 1));
#ifdef CUT_OUT
        result[1].r = min(result[1].r, texelFetch(shown_depth, pixel, 0).r);
#endif
    }
#endif
    return true;
}
