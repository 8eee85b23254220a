// Preserves the states of blades in a hash table by the exact place of their roots, and finds them again in tiles that replace
// theirs: the same blade has the same root to the bit. Open addressing; a claim is the hash, never 0.
#include "shaders/hash.glsl"
#include "shaders/blade.glsl"
#include "layout/Entry"
#include "culling/chunk_items.glsl"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) buffer Poses { Pose poses[]; };
layout(std430) buffer States { State states[]; };
layout(std430) buffer Claims { uint claims[]; };
layout(std430) buffer Entries { Entry entries[]; };

uniform int slots;  // a power of two
uniform float step_now;

void main() {
    uint i;
    if (!takeItem(i)) return;
    vec3 root = bladeRoot(blades[i]);
    uint key = hash3(floatBitsToUint(root)).x | 1u;
    uint slot = (key >> 1u) & uint(slots - 1);
#ifdef PRESERVE
    if (states[i].step != step_now) return;  // out of reach: it has not been advanced
    while (atomicCompSwap(claims[slot], 0u, key) != 0u) slot = (slot + 1u) & uint(slots - 1);
    entries[slot] = Entry(root.x, root.y, root.z, poses[i].now, states[i]);
#else
    while (claims[slot] != 0u) {
        Entry entry = entries[slot];
        if (claims[slot] == key && all(equal(vec3(entry.x, entry.y, entry.z), root))) {
            states[i] = entry.state;
            poses[i].now = entry.pose;
            return;
        }
        slot = (slot + 1u) & uint(slots - 1);
    }
#endif
}
