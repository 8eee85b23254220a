// Describes every blade that is kept, once for all stages of the pipeline: where, how wide, how finely cut, in what colours.
#include "culling/places.glsl"
#include "techniques/colours.glsl"
#include "techniques/bezier_blades/record.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 5) writeonly buffer Records { Record records[]; };

uniform int firstChunk;
uniform bool onGround;  // where the vegetation map lies

bool prepare(uint index, out Record r) {
    Blade b;
    Hull h;
    if (!hullOf(index, b, h)) return false;  // never, but for rounding: the tests have asked already
    float shape = species(bladeSpecies(b), MIX).z, wide = widthOf(b, h);
    vec3 chord = chordOf(h), across = acrossOf(b, chord);

#ifndef SHADOW
    vec3 previousControl, previousTip;
    postureBefore(index, b, h.v0, previousControl, previousTip);
    Look look = lookOf(b, h, onGround);
    r.previous = packPosture(h.here * (previousControl - h.v0), h.here * (previousTip - h.v0));
    r.trueSide = packSnorm2x16(octahedralEncode(across));
    r.rootColour = packUnorm4x8(vec4(sqrt(look.root.rgb), look.root.w));
    r.tipColour = packUnorm4x8(vec4(sqrt(look.tip.rgb), look.tip.w));
    r.look = packUnorm4x8(vec4(look.tall / 4.0, look.far, look.share, 0.0));
    r.wall = packSnorm2x16(octahedralEncode(look.wall));
#endif

    r.x = h.v0.x; r.y = h.v0.y; r.z = h.v0.z;
    r.now = packPosture(h.v1 - h.v0, h.v2 - h.v0);
    r.side = packSnorm2x16(octahedralEncode(drawnSide(across, chord, toViewerFrom(h.middle))));
    r.width = wide;
    r.levelAndShape = packHalf2x16(vec2(segments(h.v0, h.v1, h.v2, wide, h.pixel, shape), shape));
    return true;
}

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunkCount) || !isKept(chunk, lane)) return;
    uint index = chunks[uint(firstChunk) + chunk].x + lane, place = placeOf(chunk, lane);
    Record r;
    if (prepare(index, r)) {
        r.blade = index;
        records[place] = r;
    } else {
        records[place].levelAndShape = 0u;
    }
}
