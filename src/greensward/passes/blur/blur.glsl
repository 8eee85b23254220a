// Depth-weighted separable blur of what is far, along one axis (Jahrmann & Wimmer 2013, section 6.4): of seven pixels in a row two each share a look-up
// between them, so that both axes take ten look-ups.
#include "layout/Light"
#include "shaders/gbuffer.glsl"

uniform sampler2D radiance;

const float NEARER = 0.5;  // of the depth at the middle: what is nearer than that must not spread over it

// What OpenGL's depth would be, 1 at the near plane and 0 at the far one
float depthValue(float depth_m, float near_m, float far_m) {
    if (isinf(depth_m)) return 0.0;
    return clamp(near_m * (far_m - depth_m) / (depth_m * (far_m - near_m)), 0.0, 1.0);
}

// Of the middle, of both pixels one and two steps aside, and of the one three steps aside; each side's sum with the middle's
// is 1. The depth value is the middle's weight, down to what it has in the filter that blurs most.
vec3 weights(float value, bool gaussian) {
    vec3 w = gaussian ? vec3(0.2330, 0.1997 + 0.1256, 0.0581) : vec3(1.0, 2.0, 1.0) / 7.0;
    float middle = max(value, w.x);
    return vec3(middle, w.yz * (1.0 - middle) / (1.0 - w.x));
}

// Light in rgb, its weight in w
vec4 tap(ivec2 pixel, float steps, float weight, float least_m) {
    ivec2 size = textureSize(radiance, 0), along = ivec2(ALONG);
    vec2 at = (vec2(pixel) + 0.5 + steps * vec2(along)) / vec2(size);
    ivec2 inner = pixel + int(floor(abs(steps)) * sign(steps)) * along, outer = pixel + int(ceil(abs(steps)) * sign(steps)) * along;
    inner = clamp(inner, ivec2(0), size - 1);
    outer = clamp(outer, ivec2(0), size - 1);
    bool nearer = min(depthAt(inner), depthAt(outer)) < least_m;
    return nearer ? vec4(0.0) : weight * vec4(textureLod(radiance, at, 0.0).rgb, 1.0);
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    float depth_m = depthAt(pixel), least_m = NEARER * depth_m;
    vec3 w = weights(depthValue(depth_m, light.blur_near_m, light.blur_far_m), light.blur == 2);
    vec4 sum = w.x * vec4(texelFetch(radiance, pixel, 0).rgb, 1.0);
    // where the filter between two pixels weighs them as they should be
    float between = light.blur == 2 ? 1.386 : 1.5;
    sum += tap(pixel, -between, w.y, least_m) + tap(pixel, between, w.y, least_m);
    sum += tap(pixel, -3.0, w.z, least_m) + tap(pixel, 3.0, w.z, least_m);
    result[0] = vec4(sum.rgb / sum.w, 1.0);
    return true;
}
