// Writes the posture in closed form of every blade that some view of this frame needs, now and one frame ago.
#include "motion/posture.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) writeonly buffer Postures { Posture postures[]; };
layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };

uniform int firstChunk;
uniform int chunkCount;
uniform float timeNow;
uniform float timePrevious;

uint[3] posture(Blade b, float time_s) {
    vec3 v1, v2;
    stand(b, time_s, v1, v2);
    return packPosture(v1, v2);
}

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (chunk >= uint(chunkCount)) return;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    if (gl_LocalInvocationID.x >= run.y) return;
    uint i = run.x + gl_LocalInvocationID.x;
    Blade b = blades[i];
    Posture p;
    p.now = posture(b, timeNow);
    p.previous = timePrevious == timeNow ? p.now : posture(b, timePrevious);
    postures[i] = p;
}
