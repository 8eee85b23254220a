// Section 6.3: fewer and lower blades the farther they are.
#include "layout/Sward"

uniform float thinning;   // part of the blades that is left out at the reach
uniform float shrinking;  // part of their height

float partOfBlades(float away) { return 1.0 - thinning * min(away / sward.reach_m, 1.0); }

float partOfHeight(float away) { return 1.0 - shrinking * min(away / sward.reach_m, 1.0); }
