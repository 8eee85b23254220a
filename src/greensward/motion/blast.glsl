// Blast from a point (Jahrmann & Wimmer 2017): attenuation max(1 - log2(0.2 d + 1) / 4, 0), rings
// 1 - max(sin(0.4 d - 4 t), 0), whatever way the blade stands to it
Air blast(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    vec3 outward = p - a.yzw;
    float away = length(outward);
    float attenuation = max(1.0 - 0.25 * log2(0.2 * away + 1.0), 0.0);
    float ring = 1.0 - max(sin(0.4 * away - b.y * time_s), 0.0);
    vec3 velocity = outward / max(away, 1e-4) * b.x * attenuation * ring;
    return Air(vec4(vec3(0.0), 0.15 * length(velocity)), velocity);
}
