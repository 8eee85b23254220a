#include "motion/air.glsl"

// Ripples (Jahrmann & Wimmer 2013, Eq. 9): sin(c1 a) cos(c3 a), a = pi px + t + pi / 4 / (|cos(c2 pi pz)| + eps). Here px
// counts against the wind, so that the waves run with it, and a is in units of pi, which are metres: c1 pi is a turn per
// half a wavelength. Whole turns are left out of each term before they are added, as a grows with px.
Air ripples(Ripples w, uint seed, vec3 p, float time_s) {
    vec2 downwind = w.direction, lengths = vec2(w.wave_m, w.swell_m);  // lengths of the waves
    vec2 at = vec2(-dot(p.xz, downwind), dot(p.xz, vec2(downwind.y, -downwind.x)));
    float ahead = 0.25 / (abs(cos(3.14159265 * fract(at.y / w.front_m + w.anchor.z))) + w.epsilon);
    vec2 turns = fract(at.x / lengths + w.anchor.xy) + fract(vec2(1.0, lengths.x / lengths.y) * w.rate_hz * time_s) + ahead / lengths;
    turns = 6.28318531 * fract(turns);
    float power = w.speed_mps * sin(turns.x) * cos(turns.y);
    return Air(vec4(downwind.x * power, 0.0, downwind.y * power, 0.15 * abs(power)), vec3(0.0));
}
