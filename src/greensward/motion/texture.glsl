#include "motion/air.glsl"

uniform sampler2DArray wind_maps;

// Wind painted as pictures that follow one another: red and green are the velocity along x and z, 128 of 255 is calm
Air paintedWind(PaintedWind w, uint seed, vec3 p, float time_s) {
    vec2 uv = (p.xz - time_s * w.moves_mps) / w.size_m + w.anchor + 0.5;
    float shown = mod(time_s * w.rate_hz, w.layers), first = min(floor(shown), w.layers - 1.0), second = mod(first + 1.0, w.layers);
    vec2 velocity = mix(
        textureLod(wind_maps, vec3(uv, w.first_layer + first), 0.0).rg, textureLod(wind_maps, vec3(uv, w.first_layer + second), 0.0).rg,
        shown - first
    );
    velocity = w.speed_mps * (velocity * 255.0 - 128.0) / 127.0;
    return Air(vec4(velocity.x, 0.0, velocity.y, 0.15 * length(velocity)), vec3(0.0));
}
