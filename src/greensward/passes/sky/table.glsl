// Sky table: radiance of the clear sky by single scattering, for every direction.
#include "passes/sky/air.glsl"

// Directions: azimuth about y along x; along y the elevation, with most rows near the horizon.
vec3 tableDirection(vec2 uv) {
    float azimuth = uv.x * 2.0 * PI, v = uv.y * 2.0 - 1.0;
    float elevation = sign(v) * v * v * 0.5 * PI;
    return vec3(cos(elevation) * cos(azimuth), sin(elevation), cos(elevation) * sin(azimuth));
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 d = tableDirection((vec2(pixel) + 0.5) / vec2(256.0, 128.0));
    vec3 eye = vec3(0.0, EARTH_KM + 0.3, 0.0), toSun = light.to_sun.xyz;
    // below the horizon the table holds the haze in front of the ground, for distance and for light from below
    // and where there is no ground, the sky again
    float rise = light.open_below != 0 ? abs(d.y) : max(d.y, 0.0);
    vec3 ray = normalize(vec3(d.x, rise + 0.004, d.z));
    float mu = dot(d, toSun);
    float span = toSphere(eye, ray, AIR_KM);
    vec3 through = vec3(1.0), radiance = vec3(0.0);
    float previous = 0.0;
    for (int i = 0; i < 32; i++) {
        float next = span * pow((float(i) + 1.0) / 32.0, 2.0);
        float step_km = next - previous;
        vec3 p = eye + ray * (0.5 * (previous + next));
        previous = next;
        vec3 amount = airAt(length(p) - EARTH_KM);
        vec3 scatter = RAYLEIGH * amount.x * rayleighPhase(mu) + mieScatter() * amount.y * miePhase(mu);
        // light scattered more than once is nearly even in direction
        vec3 again = (RAYLEIGH * amount.x + mieScatter() * amount.y) * 0.055 * smoothstep(-0.2, 0.35, toSun.y);
        vec3 loss = extinction(amount);
        vec3 gone = exp(-loss * step_km);
        radiance += through * (scatter * sunThroughAir(p, toSun) + again) * (1.0 - gone) / max(loss, 1e-7);
        through *= gone;
    }
    radiance *= light.sun_outside.rgb * light.sky_strength;
    radiance = mix(radiance, overcastRadiance(rise), light.overcast);
    // the ground below gives back some of what falls on it
    float below = light.open_below != 0 ? 0.0 : smoothstep(0.0, -0.12, d.y);
    result[0] = vec4(mix(radiance, radiance * vec3(0.20, 0.23, 0.12), below), 1.0);
    return true;
}
