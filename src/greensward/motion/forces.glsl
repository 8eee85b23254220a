// The two papers' forces on a blade's tip, and what keeps the blade in shape after them. Points are relative to the root.
#include "shaders/blade.glsl"
#include "shaders/bezier.glsl"
#include "motion/wind.glsl"
#include "motion/force_map.glsl"
#include "layout/Motion"

const int NATURAL = 0, YAN_2024 = 1, JAHRMANN_2017 = 2;
#ifndef FORM
#define FORM motion.form
#endif

// Unit direction of gravity at a place: down, towards a centre, or a blend
vec3 pullAt(vec3 p) {
    vec3 towards = motion.centre.xyz - p;
    vec3 pull = mix(vec3(0.0, -1.0, 0.0), towards / max(length(towards), 1e-4), motion.centre.w);
    return pull / max(length(pull), 1e-4);
}

// Yan et al. 2024: gE + gF, gE = 9.8 * (0, -1, 0), gF = 0.25 |gE| * front
vec3 gravity2024(vec3 pull, vec3 front) { return motion.gravity_mps2 * (pull + motion.forward * front); }

// Jahrmann & Wimmer 2017: (g^ |g| + front * height * |g| * 0.25) * height * bend
vec3 gravity2017(vec3 pull, vec3 front, float height, float bend) {
    return motion.gravity_mps2 * (pull + motion.forward * height * front) * height * bend;
}

// Rates of recovery, per second. Yan et al. 2024: r = (iv2 - v2) * stiffness
float recovery2024(float stiffness) { return stiffness * motion.recovery_hz; }
// Jahrmann & Wimmer 2017: (idle - v2) * (1 - 0.25 bend)
float recovery2017(float bend) { return motion.recovery_hz * (1.0 - 0.25 * bend); }
// Jahrmann & Wimmer 2017: pressed blades recover by max(1 - collision, 0.1) of that
float freedom(float pressed) { return max(1.0 - pressed, 0.1); }

// Directional influence, 1 - |w^ . normalize(v2 - v0)|, and height ratio, |(v2 - v0) . up| / height (both papers)
vec3 windForce(Air air, vec3 tip, vec3 up, float height) {
    float along = dot(normalize(air.wind.xyz + 1e-9), tip / max(length(tip), 1e-6));
    return (air.wind.xyz * (1.0 - abs(along)) + air.blast) * abs(dot(tip, up)) / height;
}

// The papers' forces are metres per second, whatever the size of a blade, and their constants suit blades of theirs. With lengths
// in heights of a blade, v2' = g + r (idle - v2) + w keeps its form where g and w grow with the height, as idle does: then blades
// of any size take the shape of one of the reference height. Gravity of 2017 grows so as published.
float sizeOf(Blade b) { return motion.reference_m > 0.0 ? b.height / motion.reference_m : 1.0; }

// Forces but for recovery: metres per second of the tip
vec3 push(Blade b, Air air, vec3 tip, vec3 up, vec3 front, vec3 pull) {
    vec3 wind = sizeOf(b) * windForce(air, tip, up, b.height);
    float bend = 1.0 - b.stiffness;
    return FORM == YAN_2024 ? sizeOf(b) * gravity2024(pull, front) + wind
                                   : gravity2017(pull, front, b.height, bend) + wind * bend;
}

float recovery(Blade b) {
    return max(FORM == YAN_2024 ? recovery2024(b.stiffness) : recovery2017(1.0 - b.stiffness), 1e-3);
}

// v2 += (g + r + w) * dt, with the recovery integrated exactly: for small steps the papers' own, stable for any
vec3 relaxed(vec3 tip, vec3 idle, vec3 force, float rate, float dt) {
    float t = (1.0 - exp(-rate * dt)) / rate;
    return tip + t * (force + rate * (idle - tip));
}

// State correction (both papers): above the ground, v2 -= up * min(up . (v2 - v0), 0); then the control point from the
// length of the projection, v1 = v0 + height * up * max(1 - l / height, 0.05 * max(l / height, 1)); then the length
void correctState(Blade b, vec3 up, inout vec3 tip, out vec3 control) {
    tip -= up * min(dot(up, tip), 0.0);
    float l = length(tip - up * dot(tip, up)) / b.height;
    control = b.height * up * max(1.0 - l, 0.05 * max(l, 1.0));
    correctLength(vec3(0.0), control, tip, b.height);
}

// Where a blade rests without wind and weight: upright, or as far down as it is pressed
vec3 idleTip(Blade b, vec3 up, vec3 force) {
    vec3 control = 0.5 * b.height * up, tip = b.height * up;
    applyForce(b, up, force, control, tip);
    return tip;
}

// What is pressed down lies below the wind
Air below(Air air, vec3 force) {
    float free = 1.0 - pressedBy(force);
    return Air(free * air.wind, free * air.blast);
}

// Where forces and recovery balance: a few long steps from rest, none so long that it would throw the blade over
void balance(Blade b, Air air, vec3 force, out vec3 control, out vec3 tip) {
    vec3 up = upUnder(bladeUp(b), force), front, side, pull = pullAt(bladeRoot(b)), idle = idleTip(b, up, force);
    bladeFrame(up, b.facing, front, side);
    air = below(air, force);
    tip = idle;
    for (int i = 0; i < 8; i++) {
        vec3 moving = push(b, air, tip, up, front, pull);
        float dt = min(1.0 / recovery(b), 0.5 * b.height / max(length(moving), 1e-6));
        tip = relaxed(tip, idle, moving, recovery(b), dt);
        correctState(b, up, tip, control);
    }
}
