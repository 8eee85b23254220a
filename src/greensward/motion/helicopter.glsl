#include "motion/air.glsl"

// Helicopter wind (Yan, Wu & Wang 2024, section 5): direction normalize(-1, 0, 1) + v0, strength a wave of the distance
// along it, cos((v0 . direction - speed * t) / interval). Here v0 counts from the centre, which circles. As published the direction
// keeps its length, so the air grows with the distance without bound. Else it is fastest below the rim of the rotor and thins out
// with the distance, as the same air spreads over a wider ring.
vec2 helicopterCentre(Helicopter w, float time_s) {
    float angle = 6.28318531 * time_s / w.period_s;
    return w.centre_m + w.radius_m * vec2(cos(angle), sin(angle));
}

Air helicopter(Helicopter w, uint seed, vec3 p, float time_s) {
    vec2 offset = p.xz - helicopterCentre(w, time_s), drift = vec2(-0.70710678, 0.70710678);
    if (w.published > 0.0) {
        vec2 direction = drift + offset;
        float wave = cos((dot(offset, direction) - w.speed_mps * time_s) / w.interval_m);
        vec2 velocity = w.power_mps * mix(wave, 1.0, w.steadiness) * direction;
        return Air(vec4(velocity.x, 0.0, velocity.y, 0.3 * length(velocity)), vec3(0.0));
    }
    vec2 outward = normalize(drift * 0.05 * w.rotor_m + offset + 1e-5);
    float away = length(offset), rims = 2.0 * away / w.rotor_m;
    float wave = cos((away - w.speed_mps * time_s) / w.interval_m);
    float power = w.power_mps * mix(wave, 1.0, w.steadiness) * 2.0 * rims / (1.0 + rims * rims);
    return Air(vec4(outward.x, 0.0, outward.y, 0.3) * vec4(vec3(power), abs(power)), vec3(0.0));
}
