layout(binding = 15) uniform sampler2DArray windPictures;

// Wind painted as pictures that follow one another: red and green are the velocity along x and z, 128 of 255 is calm
Air paintedWind(vec4 a, vec4 b, vec4 c, uint seed, vec3 p, float time_s) {
    vec2 uv = p.xz / b.xy + 0.5;
    float shown = mod(time_s * a.w, b.w), first = min(floor(shown), b.w - 1.0), second = mod(first + 1.0, b.w);
    vec2 velocity = mix(
        textureLod(windPictures, vec3(uv, b.z + first), 0.0).rg, textureLod(windPictures, vec3(uv, b.z + second), 0.0).rg,
        shown - first
    );
    velocity = a.y * (velocity * 255.0 - 128.0) / 127.0;
    return Air(vec4(velocity.x, 0.0, velocity.y, 0.15 * length(velocity)), vec3(0.0));
}
