// Atmospheric scattering: Rayleigh, Mie and ozone over a spherical earth, single scattering with a term for the rest
// (coefficients of Bruneton & Neyret 2008 and Hillaire 2020, "A Scalable and Production Ready Sky and Atmosphere").
#include "layout/Light"

const float PI = 3.14159265359;
const float EARTH_KM = 6360.0, AIR_KM = 6460.0;
const vec3 RAYLEIGH = vec3(5.802e-3, 13.558e-3, 33.1e-3);   // per km at sea level
const vec3 OZONE = vec3(0.650e-3, 1.881e-3, 0.085e-3);

float mieScatter() { return 3.996e-3 * light.haze; }

// Density of the three kinds of matter at a height
vec3 airAt(float height_km) {
    return vec3(exp(-height_km / 8.0), exp(-height_km / 1.2), max(0.0, 1.0 - abs(height_km - 25.0) / 15.0));
}

vec3 extinction(vec3 amount) { return RAYLEIGH * amount.x + mieScatter() * 1.11 * amount.y + OZONE * amount.z; }

// Length of a ray from inside a sphere to its surface
float toSphere(vec3 p, vec3 d, float radius_km) {
    float b = dot(p, d), c = dot(p, p) - radius_km * radius_km;
    return -b + sqrt(max(b * b - c, 0.0));
}

bool meetsEarth(vec3 p, vec3 d) {
    float b = dot(p, d);
    return b < 0.0 && b * b - dot(p, p) + EARTH_KM * EARTH_KM > 0.0;
}

// Part of the light that reaches p from outside the air
vec3 sunThroughAir(vec3 p, vec3 toSun) {
    if (meetsEarth(p, toSun)) return vec3(0.0);
    float span = toSphere(p, toSun, AIR_KM), previous = 0.0;
    vec3 amount = vec3(0.0);
    for (int i = 1; i <= 10; i++) {
        // steps that grow: most of the air is at the start
        float next = span * float(i * i) * 0.01;
        amount += airAt(length(p + toSun * 0.5 * (previous + next)) - EARTH_KM) * (next - previous);
        previous = next;
    }
    return exp(-extinction(amount));
}

float rayleighPhase(float mu) { return 3.0 / (16.0 * PI) * (1.0 + mu * mu); }

// Cornette-Shanks phase for haze
float miePhase(float mu) {
    const float g = 0.76, gg = g * g;
    return 3.0 / (8.0 * PI) * (1.0 - gg) * (1.0 + mu * mu) / ((2.0 + gg) * pow(1.0 + gg - 2.0 * g * mu, 1.5));
}

// Radiance of the overcast sky in a direction, by the sine of its elevation: three times as bright overhead as at the horizon
// (Moon & Spencer 1942, "Illumination from a non-uniform sky"; the CIE's standard sky 16)
vec3 overcastRadiance(float sine) {
    // illuminance of the ground against that outside the air, in kilolux (Krochmann 1963); it falls quickly after sunset
    const float OUTSIDE_KLX = 133.8, PER_DEGREE = 0.75;
    float below_deg = min(degrees(asin(clamp(light.to_sun.y, -1.0, 1.0))), 0.0);
    float share = (0.3 * exp(PER_DEGREE * below_deg) + 21.0 * max(light.to_sun.y, 0.0)) / OUTSIDE_KLX;
    float ground = share * dot(light.sun_outside.rgb, vec3(0.2126, 0.7152, 0.0722)) * light.sky_strength;
    float zenith = ground * 9.0 / (7.0 * PI);
    return vec3(0.97, 1.0, 1.03) * zenith * (1.0 + 2.0 * max(sine, 0.0)) / 3.0;
}
