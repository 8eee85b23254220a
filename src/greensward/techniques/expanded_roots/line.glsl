// The middle line of a blade: its trajectory, bent as its control point and tip are.
#include "shaders/blade.glsl"
#include "shaders/bezier.glsl"
#include "shaders/hash.glsl"
#include "techniques/expanded_roots/trajectory.glsl"

uniform vec4 launch;      // speed, gravity, interval of the finest level, time to the tip
uniform vec2 angles;      // least and greatest
uniform int intervals;    // at the finest level

const float CLEARANCE = 0.06;  // of the height, that the tip keeps off the ground

float launchAngle(Blade b) { return mix(angles.x, angles.y, unit(hash3(uvec3(b.chance >> 16u, b.flags, 5u))).x); }

// Points from the root, evenly spaced in time over the whole flight at every level. `control` and `tip` are where the
// blade's own are now: the line moves with them, the more like their curve the farther they move, and each part of it keeps
// its length.
void lineOf(Blade b, vec3 control, vec3 tip, int count, out vec3 line[LINE]) {
    vec3 up = bladeUp(b), front, side;
    bladeFrame(up, b.facing, front, side);
    float angle = launchAngle(b), size = b.height / flightLength(launch.x, angle, launch.y, launch.z, intervals);
    vec3 bend = control - bladeControl(b) + bladeRoot(b), bendTip = tip - bladeTip(b) + bladeRoot(b);
    float far = smoothstep(0.0, 1.0, length(bendTip) / b.height);
    vec3 rest = vec3(0.0), moved = vec3(0.0);
    line[0] = vec3(0.0);
    for (int i = 1; i < count; i++) {
        float s = float(i) / float(count - 1);
        vec3 onCurve = bezierPoint(vec3(0.0), control, tip, s);
        if (hasHead(b)) {  // which sits on the tip
            line[i] = onCurve;
            continue;
        }
        vec2 p = size * particleAt(launch.x, angle, launch.y, s * launch.w);
        vec3 nextRest = p.x * front + p.y * up, next = mix(nextRest + 2.0 * s * (1.0 - s) * bend + s * s * bendTip, onCurve, far);
        vec3 part = next - moved;
        line[i] = line[i - 1] + part * (distance(nextRest, rest) / max(length(part), 1e-6));
        line[i] += up * max(CLEARANCE * s * b.height - dot(line[i], up), 0.0);
        rest = nextRest;
        moved = next;
    }
}
