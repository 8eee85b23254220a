#include "motion/air.glsl"

// Strong natural wind (Yan, Wu & Wang 2024, section 5): direction * power * cos((v0 . direction - speed * t) / interval)
Air strong(Strong w, uint seed, vec3 p, float time_s) {
    vec3 direction = vec3(w.direction.x, 0.0, w.direction.y);
    float wave = cos((dot(p, direction) + w.anchor - w.speed_mps * time_s) / w.interval_m);
    float power = w.power_mps * mix(wave, 1.0, w.steadiness);
    return Air(vec4(direction * power, 0.15 * abs(power)), vec3(0.0));
}
