// From a blade of the field, or of the one patch, to its outline: turned, offset and bent by what moves it.
#include "culling/presence.glsl"
#include "shaders/bezier.glsl"
#include "culling/tests.glsl"
#ifdef INSTANCED
// a file is included once: before culling/blades.glsl, which includes the same where it is built for unstored blades
#include "techniques/tessellated_quads/patch.glsl"
#include "motion/posture.glsl"
#endif
#include "techniques/colours.glsl"
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "techniques/tessellated_quads/parameters.glsl"

#ifdef INSTANCED
uniform float timeNow;
uniform float timePrevious;
#else
layout(std430, binding = 5) readonly buffer Listed { uint listed[]; };
layout(std430, binding = 11) readonly buffer Commands { uint commands[]; };  // the last of each five: how many are drawn

uniform int command;
uniform bool onGround;  // where the vegetation map lies
#endif

uniform uint firstId;
uniform float shrinking;

out Outlined blade;

// Posture now and one frame ago, relative to the root, and the id
bool fetch(out Blade b, out Hull h, out vec3 tip, out vec3 before, out uint id) {
#ifdef INSTANCED
    uint index;
    ivec2 place;
    Stored s;
    if (!takeStored(index, place, s) || !mayShow(index, place, s) || !growStored(index, place, s, b) || !isThere(b, h)) return false;
    vec3 control, previousControl;
    stand(b, timeNow, control, tip);
    stand(b, timePrevious, previousControl, before);
    id = firstId + uint(firstPlace + gl_InstanceID / chunksPerPatch) * uint(bladesStored) + index;
#else
    uint at = uint(gl_InstanceID) * 32u + uint(gl_VertexID);
    // the last instance may have more than are left
    if (at >= commands[5 * command + 4]) return false;
    uint index = listed[at];
    if (!fetchBlade(index, b) || !isThere(b, h)) return false;
    vec3 control, previousControl;
    postureNow(index, b, vec3(0.0), control, tip);
    postureBefore(index, b, vec3(0.0), previousControl, before);
    id = firstId + index;
#endif
    return true;
}

// Outline and offset (equations 2 and 3), which give the middle of the upper edge; what moves the blade is added to it
// (section 5.2). Without an offset of its own the blade leans as it was sown.
void leanAtRandom(Blade b, vec3 side, vec3 up, vec3 front, float height, vec2 offset, inout vec3 tip, inout vec3 before) {
    vec3 corners[4], rest = bladeTip(b) - bladeRoot(b);
    outline(vec3(0.0), side, up, 0.0, height, corners);
    vec3 own = corners[3] + offset.x * side + offset.y * front;
    tip = own + tip - rest;
    before = own + before - rest;
}

void main() {
    Blade b;
    Hull h;
    vec3 tip, before;
    uint id;
    gl_Position = vec4(0.0);
    blade.shape = vec4(0.0);
    if (!fetch(b, h, tip, before, id)) return;
    Parameters own = parametersAt(b);
    if (bladeRank(b) > own.density) return;
    uvec3 bits = hash3(uvec3(b.chance, b.look, floatBitsToUint(b.facing)));
    vec3 random = unit(bits), more = unit(hash3(bits));
    vec3 up = bladeUp(b), front, side;
    bladeFrame(up, b.facing, front, side);
    if (own.width_m.x >= 0.0) b.width = between(own.width_m, more.y);
    float height = own.height_m.x < 0.0 ? b.height : between(own.height_m, more.z) * swardAt(bladeRoot(b).xz).height;
    tip *= height / b.height;
    before *= height / b.height;
#ifdef LEANS_AT_RANDOM
    leanAtRandom(b, side, up, front, height, tipOffset(own.bending_m, random.xy), tip, before);
#endif
    vec2 r = vec2(mix(0.75, 1.25, random.z), mix(-0.25, 0.25, more.x));
    // section 6.3: lower with distance
    float lower = 1.0 - shrinking * min(h.away / sward.reach_m, 1.0);
    b.height = height;
    h.v1 = h.v0 + lower * controlPoint(vec3(0.0), tip, up, r);
    h.v2 = h.v0 + lower * tip;
    drawIn(h);
    float wide = widthOf(b, h);
    if (wide <= 0.0) return;
    vec3 chord = chordOf(h);

    blade.root = h.v0;
    blade.up = up;
    blade.tip = h.v2 - h.v0;
    blade.before = lower * h.here * before;
    blade.trueSide = acrossOf(b, chord);
    blade.side = wide * drawnSide(blade.trueSide, chord, toViewerFrom(h.middle));
    blade.shape = vec4(r, own.smoothness, bladeRank(b));
#ifndef SHADOW
#ifdef INSTANCED
    const bool onGround = true;
#endif
    Look look = lookOf(b, h, onGround);
    blade.look = uvec4(packUnorm4x8(vec4(sqrt(look.root.rgb), look.root.w)), packUnorm4x8(vec4(sqrt(look.tip.rgb), look.tip.w)),
                       packUnorm4x8(vec4(look.tall / 4.0, look.far, look.share, look.mapped)),
                       packSnorm2x16(octahedralEncode(look.wall)));
#endif
    blade.name = uvec2(id, bladeSpecies(b));
}
