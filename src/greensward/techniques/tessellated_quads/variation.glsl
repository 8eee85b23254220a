// What makes each instance of the one stored patch different: random values varied by the place in the world
// (Jahrmann & Wimmer 2013, section 6.2). `p` is along x or z, `q` along the other.
#include "shaders/hash.glsl"

const int HASH = 0, RATIO = 1, SHARE = 2, SINE = 3;
const float TURNS_PER_M = 12.9898;  // any constant value

float variedByRatio(float random, float p, float q) { return fract(random * p / (q == 0.0 ? 1e-6 : q)); }  // equation 10

float variedByShare(float random, float p, float dimension) { return random * p / dimension; }  // equation 11

float variedBySine(float random, float p, float c) { return random * sin(c * p); }  // equation 12

// `share` is p as a part of the dimension. What leaves the range from 0 to 1 wraps around, as equation 10 has it
float varied(int how, float random, float p, float q, float share) {
    return how == RATIO ? variedByRatio(random, p, q)
         : how == SHARE ? fract(variedByShare(random, share, 1.0))
                        : fract(variedBySine(random, p, TURNS_PER_M));
}
