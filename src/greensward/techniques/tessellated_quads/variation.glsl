// What makes each instance of the one stored patch different: random values varied by the place in the world
// (Jahrmann & Wimmer 2013, section 6.2). `p` is along x or z, `q` along the other.
const int RATIO = 0, SHARE = 1, SINE = 2;

float variedByRatio(float random, float p, float q) { return fract(random * p / (q == 0.0 ? 1e-6 : q)); }  // equation 10

float variedByShare(float random, float p, float dimension) { return random * p / dimension; }  // equation 11

float variedBySine(float random, float p, float c) { return random * sin(c * p); }  // equation 12

float varied(int how, float random, float p, float q, float dimension) {
    return how == RATIO ? variedByRatio(random, p, q)
         : how == SHARE ? variedByShare(random, p, dimension)
                        : variedBySine(random, p, 12.9898);
}
