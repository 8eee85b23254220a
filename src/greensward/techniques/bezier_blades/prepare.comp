// Describes every blade that survives culling, once for all stages of the pipeline: where, how wide, how finely cut, in what colours.
#include "culling/blade_bounds.glsl"
#include "culling/compaction.glsl"
#include "techniques/blades/blade_material.glsl"
#include "layout/BladeRecord"

layout(local_size_x = 32) in;

layout(std430) writeonly buffer Records { BladeRecord records[]; };

uniform bool on_ground;  // where the vegetation map lies

bool prepare(uint index, out BladeRecord r) {
    Blade b;
    BladeBounds h;
    if (!boundsOf(index, b, h)) return false;  // never, but for rounding: the tests have asked already
    float shape = species(bladeSpecies(b), MIX).z, wide = leafWidth(b, h);
    vec3 chord = chordOf(h), across = acrossOf(b, chord);

#ifndef SHADOW
    vec3 previousControl, previousTip;
    poseBefore(index, b, h.v0, previousControl, previousTip);
    Material material = materialOf(b, h, on_ground);
    r.previous = packPose(h.fade * (previousControl - h.v0), h.fade * (previousTip - h.v0));
    r.true_side = packSnorm2x16(octahedralEncode(across));
    r.root_colour = packUnorm4x8(vec4(sqrt(material.root.rgb), material.root.w));
    r.tip_colour = packUnorm4x8(vec4(sqrt(material.tip.rgb), material.tip.w));
    r.shading = packUnorm4x8(vec4(material.tall / 4.0, material.far, material.share, 0.0));
    r.wall = packSnorm2x16(octahedralEncode(material.wall));
#endif

    r.x = h.v0.x; r.y = h.v0.y; r.z = h.v0.z;
    r.now = packPose(h.v1 - h.v0, h.v2 - h.v0);
    r.side = packSnorm2x16(octahedralEncode(drawnSide(across, chord, toViewerFrom(h.middle))));
    r.width = wide;
    r.level_and_shape = packHalf2x16(vec2(segments(h.v0, h.v1, h.v2, wide, h.pixel, shape), shape));
    return true;
}

void main() {
    uint chunk = workgroupIndex(), lane = gl_LocalInvocationID.x;
    if (chunk >= uint(chunk_count) || !survives(chunk, lane)) return;
    uint index = chunks[uint(first_chunk) + chunk].first + lane, place = compactedIndex(chunk, lane);
    BladeRecord r;
    if (prepare(index, r)) {
        r.blade = index;
        records[place] = r;
    } else {
        records[place].level_and_shape = 0u;
    }
}
