#include "motion/air.glsl"
#include "shaders/noise.glsl"

// Gusts are noise carried along by the wind, its contrast raised; a second, slower layer keeps it from repeating.
Air gusts(Gusts w, uint seed, vec3 p, float time_s) {
    vec2 direction = w.direction;
    float speed = w.speed_mps;
    vec2 along = vec2(dot(p.xz, direction), dot(p.xz, vec2(-direction.y, direction.x)));
    // fronts are wider than they are deep, and travel with the wind
    vec2 at = (along - vec2(speed * time_s, 0.0)) * vec2(1.0, 0.55) / w.gust_m;
    float front = simplex(at + w.front.zw, ivec2(w.front.xy), seed + 17u);
    float ripple = simplex(at * 2.7 + vec2(-0.35 * speed * time_s / w.gust_m, 5.3) + w.ripple.zw, ivec2(w.ripple.xy), seed + 29u);
    float gust = smoothstep(-0.55, 0.85, 0.75 * front + 0.35 * ripple);
    float strength = speed * mix(1.0, 0.25 + 1.6 * gust, w.gustiness);
    float swerve = 0.35 * w.turbulence * ripple;
    vec2 velocity = strength * (direction + swerve * vec2(-direction.y, direction.x));
    return Air(vec4(velocity.x, 0.0, velocity.y, strength * w.turbulence), vec3(0.0));
}
