// Ripples (Jahrmann & Wimmer 2013, Eq. 9): sin(c1 a) cos(c3 a), a = pi px + t + pi / 4 / (|cos(c2 pi pz)| + eps). Here px
// counts against the wind, so that the waves run with it, and a is in units of pi, which are metres: c1 pi is a turn per
// half a wavelength. Whole turns are left out of each term before they are added, as a grows with px.
Air ripples(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    vec2 downwind = a.yz, lengths = b.xy;  // lengths of the waves
    vec2 at = vec2(-dot(p.xz, downwind), dot(p.xz, vec2(downwind.y, -downwind.x)));
    float ahead = 0.25 / (abs(cos(3.14159265 * fract(at.y / b.z))) + b.w);
    vec2 turns = fract(at.x / lengths) + fract(vec2(1.0, lengths.x / lengths.y) * c.x * time_s) + ahead / lengths;
    turns = 6.28318531 * fract(turns);
    float power = a.w * sin(turns.x) * cos(turns.y);
    return Air(vec4(downwind.x * power, 0.0, downwind.y * power, 0.15 * abs(power)), vec3(0.0));
}
