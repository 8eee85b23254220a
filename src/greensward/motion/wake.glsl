#include "motion/air.glsl"
#include "layout/Wake"

uniform sampler2DArray wake_field;  // velocities of the frame before and of this one, x and z

vec2 wakeCell(ivec2 cell, int layer) {
    bool inside = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, ivec2(wake.cells)));
    return inside ? texelFetch(wake_field, ivec3(cell, layer), 0).rg : vec2(0.0);
}

// Bilinear between the centres of cells (Derstroff, section 2.3), with weights of full precision on every driver
vec2 wakeIn(int layer, ivec2 origin, vec2 at) {
    vec2 low = floor(at), part = at - low;
    ivec2 cell = ivec2(low) - origin;
    vec2 north = mix(wakeCell(cell, layer), wakeCell(cell + ivec2(1, 0), layer), part.x);
    vec2 south = mix(wakeCell(cell + ivec2(0, 1), layer), wakeCell(cell + ivec2(1, 1), layer), part.x);
    return mix(north, south, part.y);
}

// The field of the instant: the layer of one of the two frames, or between them for steps of a simulation
Air wakeWind(WakeWind w, uint seed, vec3 p, float time_s) {
    vec2 at = p.xz / w.cell_m + w.anchor - 0.5;
    float span = wake.times_s.y - wake.times_s.x;
    float now = span > 0.0 ? clamp((time_s - wake.times_s.x) / span, 0.0, 1.0) : 1.0;
    vec2 velocity = vec2(0.0);
    if (now < 1.0) velocity += (1.0 - now) * wakeIn(0, wake.origin_before, at);
    if (now > 0.0) velocity += now * wakeIn(1, wake.origin, at);
    return Air(vec4(velocity.x, 0.0, velocity.y, 0.15 * length(velocity)), vec3(0.0));
}
