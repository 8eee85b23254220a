// Waves in three directions (Jahrmann & Wimmer 2017):
// (1 - max((cos(0.75 (x + z) + f) + sin(0.5 (x + y) + f) + sin(0.25 (y + z) + f)) / 3, 0))^2
Air waves(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    float f = 6.28318531 * b.x * time_s;
    float crest = (cos(0.75 * (p.x + p.z) + f) + sin(0.5 * (p.x + p.y) + f) + sin(0.25 * (p.y + p.z) + f)) / 3.0;
    float calm = 1.0 - max(crest, 0.0);
    float power = a.w * calm * calm;
    return Air(vec4(a.y * power, 0.0, a.z * power, 0.15 * power), vec3(0.0));
}
