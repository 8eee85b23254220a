// What is seen of the sky in a direction: the table, clouds, the sun.
#include "passes/sky/air.glsl"
#include "shaders/noise.glsl"
#include "layout/SkyLight"
#include "layout/View"

uniform sampler2D sky_table;

vec3 clearSky(vec3 d) {
    float elevation = asin(clamp(d.y, -1.0, 1.0));
    float v = sign(elevation) * sqrt(abs(elevation) / (0.5 * PI));
    float u = atan(d.z, d.x) / (2.0 * PI);
    return textureLod(sky_table, vec2(u, 0.5 * v + 0.5), 0.0).rgb;
}

// Depth of the lower clouds at a place of their pattern: above 0 within one
float cloudDepth(vec2 low, int count) {
    return octaves(low + vec2(3.1, 7.7), 431u, count, 0.56, 2.2) - (0.74 - 1.45 * light.clouds);
}

float cloudCover(float depth) { return smoothstep(0.0, 0.22, depth); }

// Place in the pattern of clouds that a ray from the camera meets
vec2 cloudPlace(vec3 d) { return d.xz / (d.y + 0.055) * 0.55 + light.cloud_origin; }

// Part of the sun that single clouds leave at a point
float throughClouds(vec3 p) {
    if (light.cloud_shadows <= 0.0 || light.to_sun.y <= 0.0) return 1.0;
    vec2 place = cloudPlace(light.to_sun.xyz) + (p.xz - view.camera_ws.xz) * light.cloud_scale;
    return 1.0 - light.cloud_shadows * cloudCover(cloudDepth(place, 5));
}

// Two layers of fair-weather cloud: streaks of cirrus, and broken puffs lower down; before them a closed layer. `clear` is
// what the table holds; how much of the sun is covered comes back.
vec3 withClouds(vec3 d, vec3 clear, out float covered) {
    covered = light.overcast;
    if ((light.clouds <= 0.0 && light.overcast <= 0.0) || (d.y <= 0.0 && light.open_below == 0)) return clear;
    float mu = dot(d, light.to_sun.xyz);
    // where there is no ground, clouds float below as well, others than above
    vec2 elsewhere = d.y < 0.0 ? vec2(41.0, 23.0) : vec2(0.0);
    d.y = abs(d.y);
    vec3 sunlit = light.sun_here.rgb * (0.045 + 0.5 * pow(max(mu, 0.0), 6.0) * 0.35);
    vec3 base = skylight.mean.rgb;
    float fade = smoothstep(0.015, 0.16, d.y);
    vec2 low = cloudPlace(d) + elsewhere;
    if (light.overcast > 0.0) {
        // the closed layer is thinner in places
        float rolls = octaves(low * vec2(0.35, 0.6) + vec2(17.0, 5.0), 443u, 5, 0.55, 2.2);
        clear *= 1.0 + light.overcast * fade * (0.3 * rolls - 0.12 * rolls * rolls);
    }
    if (light.clouds <= 0.0) return clear;

    vec2 high = d.xz / (d.y + 0.12) + elsewhere + 0.25 * light.cloud_origin;
    vec2 wisp = vec2(0.45 * high.x + 0.2 * high.y, 2.1 * high.y - 0.3 * high.x);
    float warp = octaves(wisp * 0.9, 401u, 3, 0.5, 2.2);
    float cirrus = octaves(wisp + 0.45 * warp, 409u, 5, 0.55, 2.3);
    float thin = smoothstep(0.35 - 0.75 * light.clouds, 1.0, cirrus + 0.15) * 0.6 * fade * (1.0 - light.overcast);
    vec3 colour = mix(clear, base * 0.9 + sunlit * 1.5, thin);

    float depth = cloudDepth(low, 6);
    float cover = cloudCover(depth) * fade;
    covered = max(covered, cover);
    // thick parts are dark below, the side towards the sun is bright
    float towards = cloudDepth(low + 0.16 * light.to_sun.xz, 4);
    float lit = clamp(0.55 + 1.6 * (depth - towards), 0.0, 1.2);
    vec3 cloud = base * mix(1.0, 0.62, smoothstep(0.05, 0.5, depth)) + sunlit * 2.2 * lit;
    // below a closed layer only their darker bases show
    return mix(colour, mix(cloud, clear * 0.82, light.overcast), cover * mix(0.92, 0.6, light.overcast));
}

vec3 skyRadiance(vec3 d) {
    float covered;
    vec3 colour = withClouds(d, clearSky(d), covered);
    float mu = dot(d, light.to_sun.xyz);
    float disk = smoothstep(0.999957, 0.999978, mu);
    return colour + disk * light.sun_here.rgb * 900.0 * smoothstep(-0.005, 0.005, d.y) * (1.0 - covered);
}
