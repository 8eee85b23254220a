#include "motion/air.glsl"

// Waves in three directions (Jahrmann & Wimmer 2017):
// (1 - max((cos(0.75 (x + z) + f) + sin(0.5 (x + y) + f) + sin(0.25 (y + z) + f)) / 3, 0))^2
Air waves(Waves w, uint seed, vec3 p, float time_s) {
    float f = 6.28318531 * w.rate_hz * time_s;
    float crest = (cos(0.75 * (p.x + p.z) + w.anchor.x + f) + sin(0.5 * (p.x + p.y) + w.anchor.y + f) + sin(0.25 * (p.y + p.z) + w.anchor.z + f)) / 3.0;
    float calm = 1.0 - max(crest, 0.0);
    float power = w.speed_mps * calm * calm;
    return Air(vec4(w.direction.x * power, 0.0, w.direction.y * power, 0.15 * power), vec3(0.0));
}
