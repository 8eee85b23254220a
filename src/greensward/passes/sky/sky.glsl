// What is seen of the sky in a direction: the table, clouds, the sun.
#include "passes/sky/air.glsl"
#include "shaders/noise.glsl"
#include "layout/SkyLight"

uniform sampler2D sky_table;

vec3 clearSky(vec3 d) {
    float elevation = asin(clamp(d.y, -1.0, 1.0));
    float v = sign(elevation) * sqrt(abs(elevation) / (0.5 * PI));
    float u = atan(d.z, d.x) / (2.0 * PI);
    return textureLod(sky_table, vec2(u, 0.5 * v + 0.5), 0.0).rgb;
}

// Two layers of fair-weather cloud: streaks of cirrus, and broken puffs lower down
vec3 withClouds(vec3 d, vec3 clear) {
    if (light.clouds <= 0.0 || (d.y <= 0.0 && light.open_below == 0)) return clear;
    float mu = dot(d, light.to_sun.xyz);
    // where there is no ground, clouds float below as well, others than above
    vec2 elsewhere = d.y < 0.0 ? vec2(41.0, 23.0) : vec2(0.0);
    d.y = abs(d.y);
    vec3 sunlit = light.sun_here.rgb * (0.045 + 0.5 * pow(max(mu, 0.0), 6.0) * 0.35);
    vec3 base = skylight.mean.rgb;
    float fade = smoothstep(0.015, 0.16, d.y);

    vec2 high = d.xz / (d.y + 0.12) + elsewhere;
    vec2 wisp = vec2(0.45 * high.x + 0.2 * high.y, 2.1 * high.y - 0.3 * high.x);
    float warp = octaves(wisp * 0.9, 401u, 3, 0.5, 2.2);
    float cirrus = octaves(wisp + 0.45 * warp, 409u, 5, 0.55, 2.3);
    float thin = smoothstep(0.35 - 0.75 * light.clouds, 1.0, cirrus + 0.15) * 0.6 * fade;
    vec3 colour = mix(clear, base * 0.9 + sunlit * 1.5, thin);

    vec2 low = d.xz / (d.y + 0.055) * 0.55 + elsewhere;
    float puff = octaves(low + vec2(3.1, 7.7), 431u, 6, 0.56, 2.2);
    float depth = puff - (0.74 - 1.45 * light.clouds);
    float cover = smoothstep(0.0, 0.22, depth) * fade;
    // thick parts are dark below, the side towards the sun is bright
    float towards = octaves(low + 0.16 * light.to_sun.xz + vec2(3.1, 7.7), 431u, 4, 0.56, 2.2);
    float lit = clamp(0.55 + 1.6 * (puff - towards), 0.0, 1.2);
    vec3 cloud = base * mix(1.0, 0.62, smoothstep(0.05, 0.5, depth)) + sunlit * 2.2 * lit;
    return mix(colour, cloud, cover * 0.92);
}

vec3 skyRadiance(vec3 d) {
    vec3 colour = withClouds(d, clearSky(d));
    float mu = dot(d, light.to_sun.xyz);
    float disk = smoothstep(0.999957, 0.999978, mu);
    return colour + disk * light.sun_here.rgb * 900.0 * smoothstep(-0.005, 0.005, d.y);
}
