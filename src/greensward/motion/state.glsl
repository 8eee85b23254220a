// Simulation state of a blade.
#include "layout/State"

vec3 stateTip(State s) { return vec3(s.x, s.y, s.z); }
vec3 stateVelocity(State s) { return vec3(s.vx, s.vy, s.vz); }
void setTip(inout State s, vec3 tip) { s.x = tip.x; s.y = tip.y; s.z = tip.z; }
void setVelocity(inout State s, vec3 velocity) { s.vx = velocity.x; s.vy = velocity.y; s.vz = velocity.z; }
