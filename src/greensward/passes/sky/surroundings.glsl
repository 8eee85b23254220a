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

vec3 throughAir(vec3 colour, vec3 ray, float distance_m) {
    // haze near the ground is what dims the distance; the table holds what it adds
    vec3 loss = RAYLEIGH + vec3(mieScatter() * 1.11);
    vec3 through = exp(-loss * distance_m * 1e-3);
    vec3 level = normalize(vec3(ray.x, max(ray.y, 0.0) + 0.015, ray.z));
    return colour * through + clearSky(level) * (1.0 - through);
}
