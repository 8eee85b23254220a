// Preserves the states of blades in a hash table by their permanent ids, and finds them again in tiles that replace
// theirs. Open addressing; a claim is the hash, never 0.
#include "shaders/hash.glsl"
#include "layout/Pose"
#include "layout/Entry"
#include "culling/chunk_items.glsl"

layout(local_size_x = 32) in;

layout(std430) readonly buffer Ids { uvec2 ids[]; };
layout(std430) buffer Poses { Pose poses[]; };
layout(std430) buffer States { State states[]; };
layout(std430) buffer Claims { uint claims[]; };
layout(std430) buffer Entries { Entry entries[]; };

uniform int slots;  // a power of two
uniform float step_now;

void main() {
    uint i;
    if (!takeItem(i)) return;
    uvec2 id = ids[i];
    uint key = hash3(uvec3(id, 0u)).x | 1u;
    uint slot = (key >> 1u) & uint(slots - 1);
#ifdef PRESERVE
    if (states[i].step != step_now) return;  // out of reach: it has not been advanced
    while (atomicCompSwap(claims[slot], 0u, key) != 0u) slot = (slot + 1u) & uint(slots - 1);
    entries[slot] = Entry(id.x, id.y, poses[i].now, states[i]);
#else
    while (claims[slot] != 0u) {
        Entry entry = entries[slot];
        if (claims[slot] == key && entry.low == id.x && entry.high == id.y) {
            states[i] = entry.state;
            poses[i].now = entry.pose;
            return;
        }
        slot = (slot + 1u) & uint(slots - 1);
    }
#endif
}
