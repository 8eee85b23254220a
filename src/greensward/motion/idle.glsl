#include "motion/air.glsl"
#include "shaders/hash.glsl"

// Phase of a blade in turns, from the bits of its root's place: the same for ever. The source hashes the tile and the root.
float idlePhase(vec3 root) {
    return unit(hash3(uvec3(floatBitsToUint(root.xz), 0u)).x);
}

// Idle grass (Derstroff, section 2.6): (1, 0, 1) * sin(phi + mod(t, f) / f * 2 pi) * s. Whole periods leave before the
// multiplication by 2 pi, with a fused product where the driver has one, so that the phase is as exact as the time.
Air idleWind(IdleWind w, uint seed, float phase, float time_s) {
    float rest_s = fma(-floor(time_s / w.period_s), w.period_s, time_s);
    float power = w.speed_mps * sin(6.28318531 * fract(phase + rest_s / w.period_s));
    return Air(vec4(w.direction.x * power, 0.0, w.direction.y * power, 0.15 * abs(power)), vec3(0.0));
}
