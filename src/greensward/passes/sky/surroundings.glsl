// Sky irradiance by spherical harmonics, and aerial perspective.
#include "passes/sky/sky.glsl"

// Irradiance from spherical harmonics of the sky (Ramamoorthi & Hanrahan 2001, equation 10; factors folded in)
vec3 skyIrradiance(vec3 n) {
    const float a0 = 3.141593, a1 = 2.094395, a2 = 0.785398;
    vec3 e = a0 * 0.282095 * skylight.sh[0].rgb;
    e += a1 * 0.488603 * (n.y * skylight.sh[1].rgb + n.z * skylight.sh[2].rgb + n.x * skylight.sh[3].rgb);
    e += a2 * 1.092548 * (n.x * n.y * skylight.sh[4].rgb + n.y * n.z * skylight.sh[5].rgb + n.x * n.z * skylight.sh[7].rgb);
    e += a2 * (0.315392 * (3.0 * n.z * n.z - 1.0) * skylight.sh[6].rgb + 0.546274 * (n.x * n.x - n.y * n.y) * skylight.sh[8].rgb);
    return max(e, 0.0);
}

// Extinction by fog along a ray from a height: its density falls exponentially with height
float fogDepth(float from_y, vec3 ray, float distance_m) {
    float start = light.fog_per_m * exp(min((light.fog_level_m - from_y) / light.fog_scale_m, 30.0));
    float rise = max(ray.y * distance_m / light.fog_scale_m, -30.0);
    // the mean of exp(-rise x) over x from 0 to 1
    float mean = abs(rise) < 1e-2 ? 1.0 - 0.5 * rise : (1.0 - exp(-rise)) / rise;
    return min(start * mean * distance_m, 80.0);
}

// Light of fog in a direction (Derstroff, section 3.3: the tint between blue and yellow), as bright as the sky is and the sun
// makes it
vec3 fogLight(vec3 ray) {
    const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);
    float tint = pow(max(dot(ray, light.to_sun.xyz), 0.0), light.fog_sharpness) * (1.0 - light.overcast);
    float sky = dot(skylight.mean.rgb, LUMINANCE), sun = dot(light.sun_here.rgb, LUMINANCE);
    return mix(light.fog_away.rgb * (sky + 0.06 * sun), light.fog_towards.rgb * (sky + 0.15 * sun), tint);
}

vec3 throughFog(vec3 colour, float from_y, vec3 ray, float distance_m) {
    if (light.fog_per_m <= 0.0) return colour;
    return mix(fogLight(ray), colour, exp(-fogDepth(from_y, ray, distance_m)));
}

const float SKY_M = 1e6;

// The sky as it is seen from a height
vec3 skyFrom(float y, vec3 ray) { return throughFog(skyRadiance(ray), y, ray, SKY_M); }

// Light of a point `p` that arrives along a ray
vec3 throughAir(vec3 colour, vec3 p, vec3 ray, float distance_m) {
    // haze near the ground is what dims the distance; the table holds what it adds
    vec3 loss = RAYLEIGH + vec3(mieScatter() * 1.11);
    vec3 through = exp(-loss * distance_m * 1e-3);
    vec3 level = normalize(vec3(ray.x, max(ray.y, 0.0) + 0.015, ray.z));
    vec3 hazy = colour * through + clearSky(level) * (1.0 - through);
    return throughFog(hazy, p.y - ray.y * distance_m, ray, distance_m);
}
