// Keeps the states of blades in a hash table by the exact place of their roots, and finds them again after the field has
// been sown anew: the same blade has the same root to the bit. Open addressing; a claim is the hash, never 0.
#include "shaders/hash.glsl"
#include "shaders/blade.glsl"
#include "motion/state.glsl"

layout(local_size_x = 64) in;

struct Entry { float x, y, z; uint posture[3]; State state; };

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) buffer Postures { Posture postures[]; };
layout(std430, binding = 3) buffer States { State states[]; };
layout(std430, binding = 6) buffer Claims { uint claims[]; };
layout(std430, binding = 7) buffer Entries { Entry entries[]; };

uniform int bladeCount;
uniform int slots;  // a power of two
uniform float stepNow;

void main() {
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (i >= uint(bladeCount)) return;
    vec3 root = bladeRoot(blades[i]);
    uint key = hash3(floatBitsToUint(root)).x | 1u;
    uint slot = (key >> 1u) & uint(slots - 1);
#ifdef KEEP
    if (states[i].step != stepNow) return;  // out of reach: it has not been carried on
    while (atomicCompSwap(claims[slot], 0u, key) != 0u) slot = (slot + 1u) & uint(slots - 1);
    entries[slot] = Entry(root.x, root.y, root.z, postures[i].now, states[i]);
#else
    while (claims[slot] != 0u) {
        Entry entry = entries[slot];
        if (claims[slot] == key && all(equal(vec3(entry.x, entry.y, entry.z), root))) {
            states[i] = entry.state;
            postures[i].now = entry.posture;
            return;
        }
        slot = (slot + 1u) & uint(slots - 1);
    }
#endif
}
