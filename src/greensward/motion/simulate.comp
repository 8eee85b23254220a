// Carries the state of every simulated blade on by fixed steps, in registers, and writes its posture. With BEGIN it gives
// blades the state of their closed form; with EDGE, blades far from the camera blend into that form. These are variants and
// no branches, as a CPU driver runs both sides of a branch for every blade.
#include "motion/posture.glsl"
#include "motion/state.glsl"
#include "motion/colliders.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) buffer Postures { Posture postures[]; };
layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 3) buffer States { State states[]; };

uniform int firstChunk;
uniform int chunkCount;
uniform float timeStart;        // of the first step
uniform int steps;
uniform float rest;             // a part of a step that is shown and forgotten, s
uniform int flags;              // 1: the first dispatch of a frame, 2: the last
uniform float timePrevious;     // of the frame before, in BEGIN
uniform float stepNow;          // number of the last whole step
uniform vec3 camera;
uniform mat4 previousFromNow;   // of what the blades grow on
uniform mat4 movedPerStep;      // takes a root to how far it moves in one step

const float DAMPING = 0.35;

// A damped spring about the posture that the wind asks for, in closed form over the step: stable whatever its length
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
    standInWind(b, time_s, up, v1, v2);
    // time goes slowly for what lies pressed: it stays down for a while, and then comes up
    float free = 1.0 - s.pressed;
    swing(b, v2, dt * max(free * free * free, 0.02), tip, velocity);
    control = v1 + 0.5 * (tip - v2);
    keepOff(b, up, control, tip);
    // twice: the length may push it back in
    for (int k = 0; k < 2 && collide(b, instant, root, control, tip, s.pressed); k++) {
        velocity = vec3(0.0);
        control = v1 + 0.5 * (tip - v2);
        keepOff(b, up, control, tip);
    }
    setTip(s, tip);
    setVelocity(s, velocity);
}

void stepPapers(Blade b, int instant, vec3 up, vec3 front, float time_s, float dt, inout State s, out vec3 control) {
    vec3 root = bladeRoot(b), tip = stateTip(s), force = forceOn(b, time_s);
    up = upUnder(up, force);
    vec3 moving = push(b, below(windAt(root, time_s), force), tip, up, front, pullAt(root));
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
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (chunk >= uint(chunkCount)) return;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    if (gl_LocalInvocationID.x >= run.y) return;
    uint i = run.x + gl_LocalInvocationID.x;
    Blade b = blades[i];
    vec3 control, tip;
    stand(b, timePrevious, control, tip);
    postures[i].now = packPosture(control, tip);
    stand(b, timeStart, control, tip);
    states[i] = State(tip.x, tip.y, tip.z, 0.0, 0.0, 0.0, 0.0, stepNow);
}
#else
void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (chunk >= uint(chunkCount)) return;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    if (gl_LocalInvocationID.x >= run.y) return;
    uint i = run.x + gl_LocalInvocationID.x;
    Blade b = blades[i];
    vec3 root = bladeRoot(b), up = bladeUp(b), front, side, control;
    bladeFrame(up, b.facing, front, side);
    State s = states[i], kept = s;
    vec3 lag = (movedPerStep * vec4(root, 1.0)).xyz;
    lag *= min(1.0, 0.5 * b.height / max(length(lag), 1e-9));
    bool shown = (flags & 2) != 0;
    // what is shown needs a control point, and stands a part of a step after the last whole one
    int more = shown && (rest > 1e-6 || steps == 0) ? 1 : 0;
    float time_s = timeStart;
    for (int k = 0; k < steps + more; k++) {
        float dt = k < steps ? motion.step_s : rest;
        time_s = timeStart + float(k) * motion.step_s + dt;
        stepOnce(b, min(k, colliders.instants - 1), up, front, lag * dt / motion.step_s, time_s, dt, s, control);
        if (k < steps) kept = s;
    }
    kept.step = stepNow;
    states[i] = kept;

    Posture p = postures[i];
    if ((flags & 1) != 0) {
        // as all previous postures, in the present frame of what the blade grows on
        mat3 turn = transpose(mat3(previousFromNow));
        vec3 v1, v2;
        unpackPosture(p.now, vec3(0.0), v1, v2);
        p.previous = packPosture(turn * v1, turn * v2);
    }
    vec3 tip = stateTip(s);
#ifdef EDGE
    vec3 v1, v2;
    stand(b, time_s, v1, v2);
    float far = smoothstep(0.8, 1.0, distance(root, camera) / motion.within_m);
    control = mix(control, v1, far);
    tip = mix(tip, v2, far);
    keepLength(vec3(0.0), control, tip, b.height);
#endif
    if (shown) p.now = packPosture(control, tip);
    postures[i] = p;
}
#endif
