// The wind at a point and time: every wind of the scene, added up. Velocity in m/s; speed of small eddies in w.
#include "motion/gusts.glsl"
#include "block/Winds"

vec4 windAt(vec3 p, float time_s) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < winds.count; i++) {
        vec4 row0 = winds.rows[2 * i], row1 = winds.rows[2 * i + 1];
        switch (int(row0.x)) {
            case 0: sum += gusts(row0, row1, winds.seed + uint(i) * 97u, p, time_s); break;
        }
    }
    return sum;
}
