// Decides per blade whether it is drawn, how finely, and how wide: one record for the stages of the pipeline.
#include "culling/presence.glsl"
#include "shaders/bezier.glsl"
#include "techniques/bezier_blades/record.glsl"
#include "block/BezierBlades"

layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) readonly buffer Postures { Posture postures[]; };
layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };
layout(std430, binding = 5) writeonly buffer Records { Record records[]; };

uniform int firstChunk;
uniform int chunkCount;

// Whether the hull of the control points, grown by the width, lies outside one side of the view
bool outside(vec3 v0, vec3 v1, vec3 v2, float width_m) {
    vec4 a = view.clip_from_world * vec4(v0, 1.0);
    vec4 b = view.clip_from_world * vec4(v1, 1.0);
    vec4 c = view.clip_from_world * vec4(v2, 1.0);
    mat4 m = transpose(view.clip_from_world);
    vec2 margin = width_m * (vec2(length(m[0].xyz), length(m[1].xyz)) + 1.0);
    vec2 low = max(max(a.xy + a.w, b.xy + b.w), c.xy + c.w);
    vec2 high = min(min(a.xy - a.w, b.xy - b.w), c.xy - c.w);
    return any(lessThan(low, -margin)) || any(greaterThan(high, margin));
}

// Segments that keep a quadratic curve within an error of its chords: |v0 - 2 v1 + v2| / (4 n^2) <= error.
// The outline tapers by half the width over the blade, and bends likewise where it is wide enough to tell.
float segments(vec3 v0, vec3 v1, vec3 v2, float width_m, float pixel, float shape) {
    float bend = length(v0 - 2.0 * v1 + v2) + 0.5 * max(width_m - 2.0 * pixel, 0.0);
    float n = ceil(sqrt(bend / (4.0 * bezierblades.error_px * pixel)));
    float least = shape > 5.5 ? 18.0 : 1.0;  // the lobes of a dandelion need them
    return clamp(n, least, max(least, bezierblades.max_level));
}

bool prepare(uint index, out Record r) {
    Blade b = blades[index];
    vec3 v0 = bladeRoot(b);
    float away = distance(v0, view.camera_ws.xyz), widening;
    float here = presence(b, away, widening);
    if (here <= 0.0) return false;

    vec3 v1, v2;
    unpackPosture(postures[index].now, v0, v1, v2);
    v1 = mix(v0, v1, here);
    v2 = mix(v0, v2, here);
    vec3 middle = bezierPoint(v0, v1, v2, 0.5);
    float pixel = view.pixel_m.x * max(dot(view.axis_ws.xyz, middle) + view.axis_ws.w, 0.02) + view.pixel_m.y;
    float natural = b.width * widening, least = bezierblades.min_width_px * pixel;
#ifdef SHADOW
    // a texel wide at least, but then fewer, or the shade of thin blades would grow
    if (bladeRandom(b) * least > natural) return false;
#endif
    float wide = max(natural, least) * min(1.0, 2.0 * here);
    if (outside(v0, v1, v2, wide)) return false;

    int kind = bladeSpecies(b);
    float shape = species(kind, MIX).z;
    vec3 up = bladeUp(b), front, across;
    bladeFrame(up, b.facing, front, across);
    vec3 tangent = normalize(v2 - v0);
    across = normalize(across - tangent * dot(across, tangent));
    // seen edge-on, turn the drawn side into the plane of the screen
    vec3 toViewer = normalize(view.eye_ws.xyz - middle * view.eye_ws.w);
    vec3 screenSide = cross(tangent, toViewer);
    float edgeOn = length(screenSide);
    screenSide = edgeOn > 1e-3 ? screenSide / edgeOn : across;
    if (dot(screenSide, across) < 0.0) screenSide = -screenSide;
    float facing = abs(dot(cross(across, tangent), toViewer));
    vec3 side = normalize(mix(screenSide, across, smoothstep(0.05, 0.4, facing)));

#ifndef SHADOW
    vec3 previousControl, previousTip;
    unpackPosture(postures[index].previous, v0, previousControl, previousTip);
    vec4 rootRow = species(kind, ROOT), tipRow = species(kind, TIP);
    vec3 dry = species(kind, DRY).rgb;
    float dryness = bladeDryness(b), tint = bladeTint(b) - 0.5;
    vec3 shade = vec3(1.0 + 0.55 * tint, 1.0 + 0.38 * tint, 1.0 + 0.1 * tint);
    vec3 rootColour = shade * mix(rootRow.rgb, dry * 0.55, smoothstep(0.35, 1.0, dryness));
    vec3 tipColour = shade * mix(tipRow.rgb, dry, dryness);
    vec4 map = textureLod(vegetationMap, mapUv(v0.xz), 0.0);
    rootColour = mix(rootColour, shade * map.rgb * 0.6, map.a);
    tipColour = mix(tipColour, shade * map.rgb, map.a);
    // far blades stand for many: their contrast fades towards what those would show together
    float far = smoothstep(8.0, 90.0, away);
    tipColour = mix(tipColour, tipColour / shade, 0.7 * far);
    rootColour = mix(rootColour, 0.9 * tipColour, 0.85 * far);
    r.previous = packPosture(here * (previousControl - v0), here * (previousTip - v0));
    r.trueSide = packSnorm2x16(octahedralEncode(across));
    r.rootColour = packUnorm4x8(vec4(sqrt(rootColour), rootRow.w));
    r.tipColour = packUnorm4x8(vec4(sqrt(tipColour), mix(tipRow.w, 0.95, far)));
    r.look = packUnorm4x8(vec4(b.height / max(sward.canopy_m, 1e-3) / 4.0, far, 0.0, 0.0));
    // a far blade is shaded as the wall of blades that it stands for, turned to the viewer as much as up
    r.wall = packSnorm2x16(octahedralEncode(0.8 * normalize(toViewer - up * dot(toViewer, up)) + 0.75 * up));
#endif

    r.x = v0.x; r.y = v0.y; r.z = v0.z;
    r.now = packPosture(v1 - v0, v2 - v0);
    r.side = packSnorm2x16(octahedralEncode(side));
    r.width = wide;
    r.levelAndShape = packHalf2x16(vec2(segments(v0, v1, v2, wide, pixel, shape), shape));
    return true;
}

void main() {
    uint chunk = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (chunk >= uint(chunkCount)) return;
    uint lane = gl_LocalInvocationID.x, slot = chunk * 32u + lane;
    uvec2 run = chunks[uint(firstChunk) + chunk];
    Record r;
    if (lane < run.y && prepare(run.x + lane, r)) {
        r.blade = run.x + lane;
        records[slot] = r;
    } else {
        records[slot].levelAndShape = 0u;
    }
}
