#include "motion/air.glsl"

// Whirl about a point (Jahrmann & Wimmer 2017): outwards, and around by 10 (1 - attenuation^2), where attenuation is
// max(1 - log2(0.5 d + 1) / 4, 0); in the phase sin^3(0.1 d - 1.5 t)
Air whirl(Whirl w, uint seed, vec3 p, float time_s) {
    vec3 outward = p - w.centre_ws;
    float away = length(outward);
    outward /= max(away, 1e-4);
    vec3 around = vec3(outward.z, 0.0, -outward.x);
    float attenuation = max(1.0 - 0.25 * log2(0.5 * away + 1.0), 0.0);
    float wave = sin(0.1 * away - w.rate * time_s), phase = wave * wave * wave;
    vec3 velocity = (w.power_mps * outward + w.swirl_mps * 10.0 * (1.0 - attenuation * attenuation) * around) * attenuation * phase;
    return Air(vec4(velocity, 0.15 * length(velocity)), vec3(0.0));
}
