// Pose of a blade in the wind, analytic: any instant can be drawn without those before it. Points are relative to
// the root, and so as exact far from the origin as near it.
#include "shaders/blade.glsl"
#include "shaders/bezier.glsl"
#include "motion/wind.glsl"
#include "motion/forces.glsl"
#include "motion/mass.glsl"
#include "motion/force_map.glsl"

const float MOST_LEAN = 1.25;         // radians, in a storm
const float HALF_LEAN_MPS = 7.0;      // speed at which a blade of middling stiffness leans half of that

// Lean against the wind saturates with dynamic pressure, as a bent blade gives the wind less to push.
float leanAt(float speed_mps, float stiffness) {
    float half_mps = HALF_LEAN_MPS * mix(0.45, 2.2, stiffness);
    float pressure = speed_mps * speed_mps;
    return MOST_LEAN * pressure / (pressure + half_mps * half_mps);
}

// Never into the ground (Jahrmann & Wimmer 2017: v2 -= up * min(up . (v2 - v0), 0), with a little clearance), and as long
// as it grew
void keepAboveGround(Blade b, vec3 up, inout vec3 v1, inout vec3 v2) {
    float clearance = 0.06 * b.height;
    v2 += up * max(clearance - dot(v2, up), 0.0);
    v1 += up * max(clearance - dot(v1, up), 0.0);
    correctLength(vec3(0.0), v1, v2, b.height);
}

// Weight against the stiffness of a blade that grows out of a wall or under a ceiling: it sags, or hangs straight.
vec3 sag(Blade b, vec3 up, vec3 pull) {
    float down = dot(pull, up);
    vec3 tip = bladeTip(b) - bladeRoot(b), across = pull - down * up;
    return (1.0 - 0.6 * b.stiffness) * (0.55 * b.height * across + 0.6 * max(down, 0.0) * (b.height * up - tip));
}

// Phase of a blade in idle wind. One that moves with an object is known by its random numbers instead of its place.
float ownPhase(Blade b) {
    // what is the blade's own wherever it is counted from, and whichever tile holds it; an object turns its blades
    uvec2 own = isOnObject(b) ? uvec2(b.chance, 0u) : uvec2(b.chance >> 16u, floatBitsToUint(b.facing));
    return unit(hash3(uvec3(own, 1u)).x);
}

Air airAround(Blade b, float time_s) {
    Air air = windAt(bladeRoot(b), ownPhase(b), time_s);
#ifdef MASS
    air = forced(air, massOf(b));
#endif
    return air;
}

// `swing` is the phase of its bobbing, `off` the up of what it must keep off
void bentByWindAtPhase(Blade b, Air air, float time_s, float swing, out vec3 off, out vec3 v1, out vec3 v2) {
    vec3 root = bladeRoot(b), up = bladeUp(b), force = forceOn(b, time_s);
    vec3 sunk = sag(b, up, pullAt(root));
    v1 = bladeControl(b) - root + 0.3 * sunk;
    v2 = bladeTip(b) - root + sunk;
    vec3 velocity = air.wind.xyz + air.blast;
    float speed = length(velocity);
    vec3 downwind = velocity / max(speed, 1e-4), crosswind = cross(up, downwind);

    // the phase runs up the blade
    float flutter = air.wind.w * (1.0 - 0.7 * b.stiffness);
    vec2 bob = flutter * vec2(sin(swing), sin(swing + 0.9));          // x at the middle, y at the tip
    vec2 sway = 0.35 * flutter * vec2(sin(0.73 * swing + 1.3), sin(0.73 * swing + 2.2));

    float tip = leanAt(max(speed + bob.y, 0.0), b.stiffness), middle = leanAt(max(speed + bob.x, 0.0), b.stiffness);
    float swayTip = sway.y / (abs(sway.y) + 9.0), swayMiddle = sway.x / (abs(sway.x) + 9.0);
    float free = b.height * (1.0 - pressedBy(force));
    v2 += free * (sin(tip) * downwind - (1.0 - cos(tip)) * up * 0.8 + swayTip * crosswind);
    v1 += 0.32 * free * (sin(middle) * downwind + swayMiddle * crosswind);

    off = upUnder(up, force);
    applyForce(b, off, force, v1, v2);
    keepAboveGround(b, off, v1, v2);
}

// Each blade bobs at its own pace, short ones faster
void bentByWind(Blade b, float time_s, out vec3 off, out vec3 v1, out vec3 v2) {
    float phase = 6.28318531 * bladeRandom(b);
    float pace = (2.2 + 2.6 * fract(7.31 * bladeRandom(b))) * inversesqrt(max(b.height, 0.02));
    bentByWindAtPhase(b, airAround(b, time_s), time_s, pace * time_s + phase, off, v1, v2);
}

// Bent control points of a blade without simulation state, in the form of the scene's simulation
void bentControlPoints(Blade b, float time_s, out vec3 v1, out vec3 v2) {
    vec3 up;
    if (FORM == NATURAL) bentByWind(b, time_s, up, v1, v2);
    else balance(b, airAround(b, time_s), forceOn(b, time_s), v1, v2);
}
