#include "motion/air.glsl"

// Idle grass (Derstroff, section 2.6): (1, 0, 1) * sin(phi + mod(t, f) / f * 2 pi) * s. Whole periods leave before the
// multiplication by 2 pi, with a fused product where the driver has one, so that the phase is as exact as the time.
Air idleWind(IdleWind w, uint seed, float phase, float time_s) {
    float rest_s = fma(-floor(time_s / w.period_s), w.period_s, time_s);
    float power = w.speed_mps * sin(6.28318531 * fract(phase + rest_s / w.period_s));
    return Air(vec4(w.direction.x * power, 0.0, w.direction.y * power, 0.15 * abs(power)), vec3(0.0));
}
