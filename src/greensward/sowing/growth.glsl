// How old a blade is, and what its age makes of it.
#include "shaders/hash.glsl"
#include "shaders/blade.glsl"
#include "layout/Growth"

const int KEYS = 8, HEIGHT_BY_AGE = 0, WIDTH_BY_AGE = 1, STIFFNESS_BY_AGE = 2;
const float LEAST_M = 1e-4;  // a blade of no length has no direction

// From the place where it was sown, which stays when the field is sown anew
float ageOf(vec3 root, float phase) {
    float late = unit(hash3(floatBitsToUint(root)).x);
    return clamp(phase - growth.spread * late, 0.0, 1.0);
}

// Straight between keys of age and factor, level outside; the last key is repeated
float curveAt(int curve, float age) {
    int last = curve * KEYS + KEYS - 1;
    for (int i = curve * KEYS; i < last; i++) {
        vec2 a = growth.keys[i].xy, b = growth.keys[i + 1].xy;
        if (age < b.x) return mix(a.y, b.y, clamp((age - a.x) / max(b.x - a.x, 1e-9), 0.0, 1.0));
    }
    return growth.keys[last].y;
}

void grow(inout Blade b) {
    float age = ageOf(bladeRoot(b), growth.phase), height = max(b.height, LEAST_M);
    float tall = max(curveAt(HEIGHT_BY_AGE, age), LEAST_M / height);
    vec3 root = bladeRoot(b), control = mix(root, bladeControl(b), tall), tip = mix(root, bladeTip(b), tall);
    b.x1 = control.x; b.y1 = control.y; b.z1 = control.z;
    b.x2 = tip.x; b.y2 = tip.y; b.z2 = tip.z;
    b.height *= tall;
    b.width *= curveAt(WIDTH_BY_AGE, age);
    b.stiffness = clamp(b.stiffness * curveAt(STIFFNESS_BY_AGE, age), 0.0, 1.0);
}
