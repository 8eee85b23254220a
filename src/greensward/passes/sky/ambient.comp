// Light of the sky as a whole, from the sky table: spherical harmonics up to order 2, their mean, and the exposure that suits it.
#include "layout/Light"
#include "layout/Harmonics"

layout(local_size_x = 128) in;

layout(std430) writeonly buffer Ambient { Harmonics sky_light; };

uniform sampler2D sky_table;

const float PI = 3.14159265;

shared vec3 sums[9][128];

void add(vec3 d, vec3 light_) {
    // Ramamoorthi & Hanrahan 2001, equation 3
    float basis[9] = float[](0.282095, 0.488603 * d.y, 0.488603 * d.z, 0.488603 * d.x, 1.092548 * d.x * d.y, 1.092548 * d.y * d.z,
                             0.315392 * (3.0 * d.z * d.z - 1.0), 1.092548 * d.x * d.z, 0.546274 * (d.x * d.x - d.y * d.y));
    for (int k = 0; k < 9; k++) sums[k][gl_LocalInvocationIndex] += basis[k] * light_;
}

// Scale from radiance to what the tone curve expects, as an eye would adapt to this sun and sky: a grey card of a fifth, half
// turned to the sun, comes out as a fifth by a late afternoon sun; adaptation is not complete, so that noon stays brighter and dusk darker.
float exposureFor(vec3 sky_irradiance_up) {
    const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);
    const float AFTERNOON = 3.85, ADAPTATION = 0.8;
    float towards_sun = 0.27 + 0.23 * light.to_sun.y;
    float bright = dot(light.sun_here.rgb, LUMINANCE) * towards_sun + dot(sky_irradiance_up, LUMINANCE);
    return PI / (AFTERNOON * pow(max(bright, 1e-4) / AFTERNOON, ADAPTATION)) * exp2(light.exposure_ev);
}

void main() {
    uint own = gl_LocalInvocationIndex;
    for (int k = 0; k < 9; k++) sums[k][own] = vec3(0.0);
    ivec2 size = textureSize(sky_table, 0);
    for (int i = int(own); i < size.x * size.y; i += 128) {
        ivec2 at = ivec2(i % size.x, i / size.x);
        // directions as in table.glsl
        float v = (float(at.y) + 0.5) / float(size.y) * 2.0 - 1.0, elevation = sign(v) * v * v * PI / 2.0;
        float azimuth = (float(at.x) + 0.5) / float(size.x) * 2.0 * PI;
        float solid = cos(elevation) * abs(v) * PI * (2.0 / float(size.y)) * (2.0 * PI / float(size.x));
        vec3 d = vec3(cos(elevation) * cos(azimuth), sin(elevation), cos(elevation) * sin(azimuth));
        add(d, texelFetch(sky_table, at, 0).rgb * solid);
    }
    barrier();
    for (uint half_ = 64u; half_ > 0u; half_ /= 2u) {
        if (own < half_) {
            for (int k = 0; k < 9; k++) sums[k][own] += sums[k][own + half_];
        }
        barrier();
    }
    if (own > 0u) return;
    for (int k = 0; k < 9; k++) sky_light.sh[k] = vec4(sums[k][0], 0.0);
    // irradiance on a horizontal surface (equation 7)
    vec3 up = PI * 0.282095 * sums[0][0] + 2.0 * PI / 3.0 * 0.488603 * sums[1][0] - PI / 4.0 * (0.315392 * sums[6][0] + 0.546274 * sums[8][0]);
    up = max(up, 0.0);
    sky_light.mean = vec4(up / PI, 0.0);
    sky_light.exposure = exposureFor(up);
}
