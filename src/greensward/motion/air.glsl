// Air at a place, and the structs of all kinds of wind.
#include "layout/WindKinds"

struct Air {
    vec4 wind;   // velocity in m/s; speed of small eddies in w
    vec3 blast;  // velocity that pushes a blade however it stands to it, m/s
};
