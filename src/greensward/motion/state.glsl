// What a blade remembers, in 32 bytes.
struct State {
    float x, y, z;     // tip from the root, metres
    float pressed;     // collision strength, 0 to 1
    float vx, vy, vz;  // velocity of the tip, m/s
    float step;        // up to which it was carried
};

vec3 stateTip(State s) { return vec3(s.x, s.y, s.z); }
vec3 stateVelocity(State s) { return vec3(s.vx, s.vy, s.vz); }
void setTip(inout State s, vec3 tip) { s.x = tip.x; s.y = tip.y; s.z = tip.z; }
void setVelocity(inout State s, vec3 velocity) { s.vx = velocity.x; s.vy = velocity.y; s.vz = velocity.z; }
