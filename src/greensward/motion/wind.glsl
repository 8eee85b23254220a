// The wind at a point and time: every wind of the scene, added up.
#include "block/Winds"

struct Air {
    vec4 wind;   // velocity in m/s; speed of small eddies in w
    vec3 blast;  // velocity that pushes a blade however it stands to it, m/s
};

#include "motion/gusts.glsl"
#include "motion/strong.glsl"
#include "motion/helicopter.glsl"
#include "motion/random.glsl"
#include "motion/waves.glsl"
#include "motion/blast.glsl"
#include "motion/whirl.glsl"
#include "motion/texture.glsl"

Air windAt(vec3 p, float time_s) {
    Air sum = Air(vec4(0.0), vec3(0.0));
    for (int i = 0; i < winds.count; i++) {
        vec4 a = winds.rows[3 * i], b = winds.rows[3 * i + 1], c = winds.rows[3 * i + 2];
        uint seed = winds.seed + uint(i) * 97u;
        Air one;
        switch (int(a.x)) {
            case 0: one = gusts(a, b, c, seed, p, time_s); break;
            case 1: one = strong(a, b, c, seed, p, time_s); break;
            case 2: one = helicopter(a, b, c, seed, p, time_s); break;
            case 3: one = randomWind(a, b, c, seed, p, time_s); break;
            case 4: one = waves(a, b, c, seed, p, time_s); break;
            case 5: one = blast(a, b, c, seed, p, time_s); break;
            case 6: one = whirl(a, b, c, seed, p, time_s); break;
            default: one = paintedWind(a, b, c, seed, p, time_s); break;
        }
        sum.wind += one.wind;
        sum.blast += one.blast;
    }
    return sum;
}
