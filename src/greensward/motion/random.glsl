#include "motion/air.glsl"
#include "shaders/hash.glsl"
#include "layout/Winds"

// Random natural wind (Yan, Wu & Wang 2024, section 5): random3(v0) * 3 * sin(t), for places a centimetre apart
Air randomWind(RandomWind w, uint seed, vec3 p, float time_s) {
    vec3 direction = 2.0 * unit(hash3(uvec3(ivec3(floor(p * 100.0)) + ivec3(winds.anchor_cm, 0).xzy) ^ uvec3(seed))) - 1.0;
    vec3 velocity = direction * w.power_mps * sin(6.28318531 * time_s / w.period_s);
    return Air(vec4(velocity, 0.15 * length(velocity)), vec3(0.0));
}
