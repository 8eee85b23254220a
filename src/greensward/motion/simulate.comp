// Advances the state of every simulated blade by fixed steps, in registers, and writes its pose. With BEGIN it gives blades
// the state of their analytic motion; with EDGE, blades far from the camera blend into that. These are variants and
// no branches, as a CPU driver runs both sides of a branch for every blade.
#include "motion/pose.glsl"
#include "motion/state.glsl"
#include "culling/chunk_items.glsl"
#include "motion/colliders.glsl"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) buffer Poses { Pose poses[]; };
layout(std430) buffer States { State states[]; };

uniform float start_s;        // of the first step
uniform int steps;
uniform float rest;             // a part of a step that is shown and forgotten, s
uniform int flags;              // 1: the first dispatch of a frame, 2: the last
uniform float previous_time_s;     // of the frame before, in BEGIN
uniform float step_now;          // number of the last whole step
uniform vec3 camera;
uniform mat4 previous_from_now;   // of what the blades grow on
uniform mat4 moved_per_step;      // takes a root to how far it moves in one step

const float DAMPING = 0.35;

// Damped spring about the pose that the wind asks for, integrated exactly over the step: stable whatever its length
void swing(Blade b, vec3 target, float dt, inout vec3 tip, inout vec3 velocity) {
    float pace = (2.2 + 2.6 * fract(7.31 * bladeRandom(b))) * inversesqrt(max(b.height, 0.02));
    float w = 1.8 * pace * (0.7 + 0.6 * b.stiffness), d = w * sqrt(1.0 - DAMPING * DAMPING);
    float fade = exp(-DAMPING * w * dt), c = cos(d * dt), s = sin(d * dt) / d;
    vec3 x = tip - target, v = velocity;
    tip = target + fade * (x * (c + DAMPING * w * s) + v * s);
    velocity = fade * (v * (c - DAMPING * w * s) - x * w * w * s);
}

void stepNatural(Blade b, int instant, vec3 up, float time_s, float dt, inout State s, out vec3 control) {
    vec3 root = bladeRoot(b), v1, v2, tip = stateTip(s), velocity = stateVelocity(s);
    bentByWind(b, time_s, up, v1, v2);
    // time goes slowly for what lies pressed: it stays down for a while, and then comes up
    float free = 1.0 - s.pressed;
    swing(b, v2, dt * max(free * free * free, 0.02), tip, velocity);
    control = v1 + 0.5 * (tip - v2);
    keepAboveGround(b, up, control, tip);
    // twice: the length may push it back in
    for (int k = 0; k < 2 && collide(b, instant, root, control, tip, s.pressed); k++) {
        velocity = vec3(0.0);
        control = v1 + 0.5 * (tip - v2);
        keepAboveGround(b, up, control, tip);
    }
    setTip(s, tip);
    setVelocity(s, velocity);
}

void stepPapers(Blade b, int instant, vec3 up, vec3 front, float time_s, float dt, inout State s, out vec3 control) {
    vec3 root = bladeRoot(b), tip = stateTip(s), force = forceOn(b, time_s);
    up = upUnder(up, force);
    vec3 moving = push(b, below(airAround(b, time_s), force), tip, up, front, pullAt(root));
    tip = relaxed(tip, idleTip(b, up, force), moving, recovery(b) * freedom(s.pressed), dt);
    correctState(b, up, tip, control);
    if (collide(b, instant, root, control, tip, s.pressed)) correctState(b, up, tip, control);
    setTip(s, tip);
}

void stepOnce(Blade b, int instant, vec3 up, vec3 front, vec3 lag, float time_s, float dt, inout State s, out vec3 control) {
    setTip(s, stateTip(s) - lag);
    if (FORM == NATURAL) stepNatural(b, instant, up, time_s, dt, s, control);
    else stepPapers(b, instant, up, front, time_s, dt, s, control);
    // collision strength falls by (1 - bend) * 0.5 * dt (Jahrmann & Wimmer 2017), 0.5 being 1 / rise_s
    s.pressed = max(s.pressed - max(b.stiffness, 0.1) * dt / motion.rise_s, 0.0);
}

#ifdef BEGIN
void main() {
    uint i;
    if (!takeItem(i)) return;
    Blade b = blades[i];
    vec3 control, tip;
    bentControlPoints(b, previous_time_s, control, tip);
    poses[i].now = packPose(control, tip);
    bentControlPoints(b, start_s, control, tip);
    states[i] = State(tip.x, tip.y, tip.z, 0.0, 0.0, 0.0, 0.0, step_now);
}
#else
void main() {
    uint i;
    if (!takeItem(i)) return;
    Blade b = blades[i];
    vec3 root = bladeRoot(b), up = bladeUp(b), front, side, control;
    bladeFrame(up, b.facing, front, side);
    State s = states[i], whole = s;
    vec3 lag = (moved_per_step * vec4(root, 1.0)).xyz;
    lag *= min(1.0, 0.5 * b.height / max(length(lag), 1e-9));
    bool shown = (flags & 2) != 0;
    // what is shown needs a control point, and stands a part of a step after the last whole one
    int more = shown && (rest > 1e-6 || steps == 0) ? 1 : 0;
    float time_s = start_s;
    for (int k = 0; k < steps + more; k++) {
        float dt = k < steps ? motion.step_s : rest;
        time_s = start_s + float(k) * motion.step_s + dt;
        stepOnce(b, min(k, colliders.instants - 1), up, front, lag * dt / motion.step_s, time_s, dt, s, control);
        if (k < steps) whole = s;
    }
    whole.step = step_now;
    states[i] = whole;

    Pose p = poses[i];
    if ((flags & 1) != 0) {
        // as all previous poses, in the present frame of what the blade grows on
        mat3 turn = transpose(mat3(previous_from_now));
        vec3 v1, v2;
        unpackPose(p.now, vec3(0.0), v1, v2);
        p.previous = packPose(turn * v1, turn * v2);
    }
    vec3 tip = stateTip(s);
#ifdef EDGE
    vec3 v1, v2;
    bentControlPoints(b, time_s, v1, v2);
    float far = smoothstep(0.8, 1.0, distance(root, camera) / motion.within_m);
    control = mix(control, v1, far);
    tip = mix(tip, v2, far);
    correctLength(vec3(0.0), control, tip, b.height);
#endif
    if (shown) p.now = packPose(control, tip);
    poses[i] = p;
}
#endif
