// Describes every blade that is kept, once for all stages of the pipeline: where, how wide, how finely cut, in what colours.
#include "culling/places.glsl"
#include "techniques/bezier_blades/width.glsl"
#include "techniques/bezier_blades/record.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 5) writeonly buffer Records { Record records[]; };

uniform int firstChunk;
uniform bool onGround;  // where the vegetation map lies

// Segments that keep a quadratic curve within an error of its chords: |v0 - 2 v1 + v2| / (4 n^2) <= error.
// The outline tapers by half the width over the blade, and bends likewise where it is wide enough to tell.
float segments(vec3 v0, vec3 v1, vec3 v2, float width_m, float pixel, float shape) {
    float bend = length(v0 - 2.0 * v1 + v2) + 0.5 * max(width_m - 2.0 * pixel, 0.0);
    float n = ceil(sqrt(bend / (4.0 * bezierblades.error_px * pixel)));
    float least = shape > 5.5 ? 18.0 : 1.0;  // the lobes of a dandelion need them
    return clamp(n, least, max(least, bezierblades.max_level));
}

// The side as drawn: seen edge-on, turned into the plane of the screen, unless the blade is to vanish there
vec3 drawnSide(vec3 across, vec3 chord, vec3 toViewer) {
    if (bezierblades.orientation_limit <= 1.0) return across;
    vec3 screenSide = cross(chord, toViewer);
    float edgeOn = length(screenSide);
    screenSide = edgeOn > 1e-3 ? screenSide / edgeOn : across;
    if (dot(screenSide, across) < 0.0) screenSide = -screenSide;
    float facing = abs(dot(cross(across, chord), toViewer));
    return normalize(mix(screenSide, across, smoothstep(0.05, 0.4, facing)));
}

bool prepare(uint index, out Record r) {
    Blade b;
    Hull h;
    if (!hullOf(index, b, h)) return false;  // never, but for rounding: the tests have asked already
    int kind = bladeSpecies(b);
    float shape = species(kind, MIX).z, wide = widthOf(b, h);
    vec3 up = bladeUp(b), chord = chordOf(h), across = acrossOf(b, chord), toViewer = toViewerFrom(h.middle);

#ifndef SHADOW
    vec3 previousControl, previousTip;
    unpackPosture(postures[index].previous, h.v0, previousControl, previousTip);
    vec4 rootRow = species(kind, ROOT), tipRow = species(kind, TIP);
    vec3 dry = species(kind, DRY).rgb;
    float dryness = bladeDryness(b), tint = bladeTint(b) - 0.5;
    vec3 shade = vec3(1.0 + 0.55 * tint, 1.0 + 0.38 * tint, 1.0 + 0.1 * tint);
    vec3 rootColour = shade * mix(rootRow.rgb, dry * 0.55, smoothstep(0.35, 1.0, dryness));
    vec3 tipColour = shade * mix(tipRow.rgb, dry, dryness);
    vec4 map = onGround ? textureLod(vegetationMap, mapUv(h.v0.xz), 0.0) : vec4(0.0);
    rootColour = mix(rootColour, shade * map.rgb * 0.6, map.a);
    tipColour = mix(tipColour, shade * map.rgb, map.a);
    // far blades stand for many: their contrast fades towards what those would show together
    float far = smoothstep(8.0, 90.0, h.away);
    tipColour = mix(tipColour, tipColour / shade, 0.7 * far);
    rootColour = mix(rootColour, 0.9 * tipColour, 0.85 * far);
    r.previous = packPosture(h.here * (previousControl - h.v0), h.here * (previousTip - h.v0));
    r.trueSide = packSnorm2x16(octahedralEncode(across));
    r.rootColour = packUnorm4x8(vec4(sqrt(rootColour), rootRow.w));
    r.tipColour = packUnorm4x8(vec4(sqrt(tipColour), mix(tipRow.w, 0.95, far)));
    r.look = packUnorm4x8(vec4(b.height / max(sward.canopy_m, 1e-3) / 4.0, far, 0.0, 0.0));
    // a far blade is shaded as the wall of blades that it stands for, turned to the viewer as much as up
    r.wall = packSnorm2x16(octahedralEncode(0.8 * normalize(toViewer - up * dot(toViewer, up)) + 0.75 * up));
#endif

    r.x = h.v0.x; r.y = h.v0.y; r.z = h.v0.z;
    r.now = packPosture(h.v1 - h.v0, h.v2 - h.v0);
    r.side = packSnorm2x16(octahedralEncode(drawnSide(across, chord, toViewer)));
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
