// Strong natural wind (Yan, Wu & Wang 2024, section 5): direction * power * cos((v0 . direction - speed * t) / interval)
Air strong(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    vec3 direction = vec3(a.y, 0.0, a.z);
    float wave = cos((dot(p, direction) - b.x * time_s) / b.y);
    float power = a.w * mix(wave, 1.0, b.z);
    return Air(vec4(direction * power, 0.15 * abs(power)), vec3(0.0));
}
