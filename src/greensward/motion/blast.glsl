#include "motion/air.glsl"

// Blast from a point (Jahrmann & Wimmer 2017): attenuation max(1 - log2(0.2 d + 1) / 4, 0), rings
// 1 - max(sin(0.4 d - 4 t), 0), whatever the direction of the blade
Air blast(Blast w, uint seed, vec3 p, float time_s) {
    vec3 outward = p - w.centre_ws;
    float away = length(outward);
    float attenuation = max(1.0 - 0.25 * log2(0.2 * away + 1.0), 0.0);
    float ring = 1.0 - max(sin(0.4 * away - w.rate * time_s), 0.0);
    vec3 velocity = outward / max(away, 1e-4) * w.power_mps * attenuation * ring;
    return Air(vec4(vec3(0.0), 0.15 * length(velocity)), velocity);
}
