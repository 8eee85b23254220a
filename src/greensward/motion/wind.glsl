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
#include "motion/ripples.glsl"

// A scene's shaders leave out the kinds that it has not: a CPU driver runs every case for every blade.
Air windAt(vec3 p, float time_s) {
    Air sum = Air(vec4(0.0), vec3(0.0));
    for (int i = 0; i < winds.count; i++) {
        vec4 a = winds.rows[3 * i], b = winds.rows[3 * i + 1], c = winds.rows[3 * i + 2];
        uint seed = winds.seed + uint(i) * 97u;
        int kind = int(a.x);
        Air one = Air(vec4(0.0), vec3(0.0));
#ifndef NO_GUSTS
        if (kind == 0) one = gusts(a, b, c, seed, p, time_s);
#endif
#ifndef NO_STRONG
        if (kind == 1) one = strong(a, b, c, seed, p, time_s);
#endif
#ifndef NO_HELICOPTER
        if (kind == 2) one = helicopter(a, b, c, seed, p, time_s);
#endif
#ifndef NO_RANDOM
        if (kind == 3) one = randomWind(a, b, c, seed, p, time_s);
#endif
#ifndef NO_WAVES
        if (kind == 4) one = waves(a, b, c, seed, p, time_s);
#endif
#ifndef NO_BLAST
        if (kind == 5) one = blast(a, b, c, seed, p, time_s);
#endif
#ifndef NO_WHIRL
        if (kind == 6) one = whirl(a, b, c, seed, p, time_s);
#endif
#ifndef NO_TEXTURE
        if (kind == 7) one = paintedWind(a, b, c, seed, p, time_s);
#endif
#ifndef NO_RIPPLES
        if (kind == 8) one = ripples(a, b, c, seed, p, time_s);
#endif
        sum.wind += one.wind;
        sum.blast += one.blast;
    }
    return sum;
}
