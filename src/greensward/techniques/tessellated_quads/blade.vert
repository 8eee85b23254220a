// From a blade of the field, or of the one patch, to its outline: turned, offset and bent by what moves it.
#include "culling/level_of_detail.glsl"
#include "layout/DrawCommand"
#include "shaders/bezier.glsl"
#include "culling/tests.glsl"
#ifdef INSTANCED
#include "techniques/tessellated_quads/patch.glsl"
#include "motion/pose.glsl"
#else
#include "culling/blades.glsl"
#endif
#include "techniques/blades/blade_material.glsl"
#include "techniques/tessellated_quads/quad.glsl"
#include "techniques/tessellated_quads/outlined.glsl"
#include "techniques/tessellated_quads/parameters.glsl"

#ifdef INSTANCED
uniform float time_s;
uniform float previous_time_s;
#else
layout(std430) readonly buffer Listed { uint listed[]; };
layout(std430) readonly buffer Commands { DrawCommand commands[]; };

uniform int command;
uniform bool on_ground;  // where the vegetation map lies
#endif

uniform uint first_blade_number;
uniform float shrinking;

out Outlined blade;

// Pose now and one frame ago, relative to the root, and the id
bool fetch(out Blade b, out BladeBounds h, out vec3 tip, out vec3 before, out uint id) {
#ifdef INSTANCED
    uint index;
    ivec2 place;
    PatternRoot s;
    if (!takeStored(index, place, s) || !mayShow(index, place, s) || !growStored(index, place, s, b) || !startBounds(b, h)) return false;
    vec3 control, previousControl;
    bentControlPoints(b, time_s, control, tip);
    bentControlPoints(b, previous_time_s, previousControl, before);
    id = first_blade_number + uint(first_place + gl_InstanceID / chunks_per_patch) * uint(blades_stored) + index;
#else
    uint at = uint(gl_InstanceID) * 32u + uint(gl_VertexID);
    // the last instance may have more than are left
    if (at >= commands[command].survivors) return false;
    uint index = listed[at];
    if (!fetchBlade(index, b) || !startBounds(b, h)) return false;
    vec3 control, previousControl;
    poseNow(index, b, vec3(0.0), control, tip);
    poseBefore(index, b, vec3(0.0), previousControl, before);
    id = first_blade_number + index;
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
    BladeBounds h;
    vec3 tip, before;
    uint id;
    gl_Position = vec4(0.0);
    blade.shape = vec4(0.0);
    if (!fetch(b, h, tip, before, id)) return;
    Parameters own = parametersAt(b);
    if (bladeRank(b) > own.density) return;
    // without the rank, which is rounded to the level of the tile that holds the blade
    uvec3 bits = hash3(uvec3(b.chance >> 16u, b.flags, floatBitsToUint(b.facing)));
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
    shrinkByFade(h);
    float wide = leafWidth(b, h);
    if (wide <= 0.0) return;
    vec3 chord = chordOf(h);

    blade.root = h.v0;
    blade.up = up;
    blade.tip = h.v2 - h.v0;
    blade.before = lower * h.fade * before;
    blade.trueSide = acrossOf(b, chord);
    blade.side = wide * drawnSide(blade.trueSide, chord, toViewerFrom(h.middle));
    blade.shape = vec4(r, own.smoothness, bladeRank(b));
#ifndef SHADOW
#ifdef INSTANCED
    const bool on_ground = true;
#endif
    Material material = materialOf(b, h, on_ground);
    blade.material = uvec4(packUnorm4x8(vec4(sqrt(material.root.rgb), material.root.w)), packUnorm4x8(vec4(sqrt(material.tip.rgb), material.tip.w)),
                       packUnorm4x8(vec4(material.tall / 4.0, material.far, material.share, material.mapped)),
                       packSnorm2x16(octahedralEncode(material.wall)));
#endif
    blade.numberAndSpecies = uvec2(id, bladeSpecies(b));
}
