// Helicopter wind (Yan, Wu & Wang 2024, section 5): direction normalize(-1, 0, 1) + v0, strength a wave of the distance
// along it. Here v0 counts from the centre, which circles; the air is fastest below the rim of the rotor and thins out
// with the distance, as the same air spreads over a wider ring. The report's grows with distance without bound.
vec2 helicopterCentre(vec4 a, vec4 b, float time_s) {
    float angle = 6.28318531 * time_s / b.y;
    return a.yz + a.w * vec2(cos(angle), sin(angle));
}

Air helicopter(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    vec2 offset = p.xz - helicopterCentre(a, b, time_s), drift = vec2(-0.70710678, 0.70710678);
    vec2 outward = normalize(drift * 0.05 * b.z + offset + 1e-5);
    float away = length(offset), rims = 2.0 * away / b.z;
    float wave = cos((away - c.x * time_s) / c.y);
    float power = b.x * mix(wave, 1.0, c.z) * 2.0 * rims / (1.0 + rims * rims);
    return Air(vec4(outward.x, 0.0, outward.y, 0.3) * vec4(vec3(power), abs(power)), vec3(0.0));
}
