// What presses the grass of the ground down or pushes it aside (Jahrmann & Wimmer 2013, section 5.2): layers that add up.
#include "shaders/blade.glsl"
#include "layout/Sward"

#ifndef NO_FORCES
#include "layout/Forces"
#include "layout/ForceLayers"

uniform sampler2DArray force_maps;  // x, up, z, and seconds from the start until it presses

const float PRESSING_S = 0.15;  // from the first touch to the full weight
const float DECAY = 3.0;

// How much of a press there is so long after it: it comes down at once, or was there from the beginning, and goes as
// exp(-3 age / fades_s), less what that is at the end
float forceLeft(float age_s, float fades_s, bool always) {
    float end = exp(-DECAY), part = clamp(age_s / max(fades_s, 1e-6), 0.0, 1.0);
    float left = fades_s <= 0.0 ? 1.0 : part < 1.0 ? (exp(-DECAY * part) - end) / (1.0 - end) : 0.0;
    return always ? left : left * smoothstep(0.0, PRESSING_S, age_s);
}

vec3 layerAt(int i, vec2 xz, float time_s) {
    ForceLayer layer = forceLayer(i);
    vec2 p = xz - layer.centre_m, q = vec2(layer.turn.x * p.x - layer.turn.y * p.y, layer.turn.y * p.x + layer.turn.x * p.y);
    if (any(greaterThan(abs(q), layer.half_size_m))) return vec3(0.0);
    // in texels, and not beyond the middle of the last, next to which another layer's may lie
    vec2 at = clamp((0.5 * q / layer.half_size_m + 0.5) * layer.texels, vec2(0.5), layer.texels - 0.5) / vec2(textureSize(force_maps, 0).xy);
    vec4 found = textureLod(force_maps, vec3(at, float(i)), 0.0);
    found.xyz *= forceLeft(time_s - layer.start_s - found.w, layer.fades_s, layer.always != 0.0);
    return vec3(layer.turn.x * found.x + layer.turn.y * found.z, found.y, layer.turn.x * found.z - layer.turn.y * found.x);
}

// In heights of the blade, at most 1 long
vec3 forceAt(vec2 xz, float time_s) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < forces.count; i++) sum += layerAt(i, xz, time_s);
    return sum / max(length(sum), 1.0);
}
#endif

// On a blade; those on objects feel none
vec3 forceOn(Blade b, float time_s) {
#ifdef NO_FORCES
    return vec3(0.0);
#else
    return isOnObject(b) ? vec3(0.0) : forceAt(vec2(b.x, b.z), time_s);
#endif
}

float pressedBy(vec3 force) { return clamp(-force.y, 0.0, 1.0); }

// The up that a blade lies flat to: its own, which is normalize(mix(vertical, normal of the ground, along_normal)), and the
// more it is pressed, that normal
vec3 upUnder(vec3 up, vec3 force) {
    float down = pressedBy(force), turned = sward.along_normal, upright = 1.0 - turned;
    if (down <= 0.0 || turned <= 0.0) return up;
    float along = upright * up.y + sqrt(max(upright * upright * up.y * up.y - (1.0 - 2.0 * turned), 0.0));
    return normalize(mix(up, normalize(along * up - vec3(0.0, upright, 0.0)), down));
}

// Jahrmann & Wimmer 2013, section 5.2: the force is added to the offset of the upper vertices. In the paper blades have no
// length to keep; here what goes down must go aside, in the direction of its lean. Points are relative to the root.
void applyForce(Blade b, vec3 up, vec3 force, inout vec3 v1, inout vec3 v2) {
#ifndef NO_FORCES
    float h = b.height, down = pressedBy(force);
    vec3 front, side, push = vec3(force.x, 0.0, force.z);
    bladeFrame(up, b.facing, front, side);
    push -= dot(push, up) * up;
    v2 += h * (push + force.y * up);
    v1 += h * (0.32 * push + 0.5 * force.y * up);
    // some springier than others
    v2 += up * max((0.06 + 0.07 * bladeRandom(b)) * h * down - dot(v2, up), 0.0);

    vec3 aside = v2 - dot(v2, up) * up;
    float away = length(aside), tall = dot(v2, up);
    vec3 direction = aside + 0.1 * h * front;
    direction /= max(length(direction), 1e-6);
    v2 += down * max(sqrt(max(0.94 * h * h - tall * tall, 0.0)) - away, 0.0) * direction;
    v1 = mix(v1, h * (0.45 * direction + 0.1 * up), down);
#endif
}
