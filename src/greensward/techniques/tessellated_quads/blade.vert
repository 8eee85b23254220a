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
#include "techniques/tessellated_quads/thinning.glsl"

const float TURN = 6.28318531;

#ifdef INSTANCED
uniform float time_s;
uniform float previous_time_s;
const bool on_ground = true;
#else
layout(std430) readonly buffer Listed { uint listed[]; };
layout(std430) readonly buffer Commands { DrawCommand commands[]; };

uniform int command;
uniform bool on_ground;  // where patches and maps lie
#endif

uniform uint first_blade_number;
uniform uint own_colours;  // bits of the species that have a diffuse texture

out Outlined blade;

// What a blade is drawn from: its pose now and one frame ago from the root, what its patch says, its id, and the eight random
// values of section 4.2: its angle; two of equation 3, two of equation 2, two of equation 6; and whether it stays
struct Fetched {
    Blade b;
    BladeBounds h;
    vec3 tip, before;
    Parameters own;
    uint id;
    float random[8];
};

#ifdef INSTANCED
bool fetch(out Fetched f) {
    uint index;
    ivec2 place;
    PatternRoot s;
    if (!takeStored(index, place, s) || !mayShow(index, place, s)) return false;
    f.random = variedRandoms(index, place, s);
    f.own = parametersOf(place);
    if (f.random[7] >= f.own.density || !growStored(index, place, s, f.random, f.b) || !startBounds(f.b, f.h)) return false;
#ifdef RANDOM_QUADS
    f.b.facing = TURN * f.random[0];
#endif
    vec3 control, previousControl;
    bentControlPoints(f.b, time_s, control, f.tip);
    bentControlPoints(f.b, previous_time_s, previousControl, f.before);
    f.id = first_blade_number + uint(first_place + gl_InstanceID / chunks_per_patch) * uint(blades_stored) + index;
    return true;
}
#else
// From what is a blade's own wherever it is sown from; without the rank, which is rounded to the level of its tile
float[8] storedRandoms(Blade b) {
    uvec3 first = hash3(uvec3(b.chance >> 16u, b.flags, floatBitsToUint(b.facing))), second = hash3(first), third = hash3(second);
    vec3 x = unit(first), y = unit(second), z = unit(third);
    // a stored blade is turned already
    return float[8](fract(b.facing / TURN), x.x, x.y, x.z, y.x, y.y, y.z, z.x);
}

bool fetch(out Fetched f) {
    uint at = uint(gl_InstanceID) * 32u + uint(gl_VertexID);
    // the last instance may have more than are left
    if (at >= commands[command].survivors) return false;
    uint index = listed[at];
    if (!fetchBlade(index, f.b) || !startBounds(f.b, f.h)) return false;
    f.random = storedRandoms(f.b);
    f.own = on_ground ? parametersOf(patchAt(bladeRoot(f.b).xz)) : parametersOnObject();
    if (f.random[7] >= f.own.density) return false;
    vec3 control, previousControl;
    poseNow(index, f.b, vec3(0.0), control, f.tip);
    poseBefore(index, f.b, vec3(0.0), previousControl, f.before);
    f.id = first_blade_number + index;
    return true;
}
#endif

// Fewer blades crowd where a patch leaves some out
void thinOut(inout Blade b, float density) {
    float crowding = max(float(b.flags >> 24u) + 8.0 * log2(density), 0.0);
    b.flags = (b.flags & 0xffffffu) | uint(crowding + 0.5) << 24u;
}

// The size of equation 2, where the patch or the setting asks for it. Returns what this makes of the height
float resize(inout Blade b, Parameters own, float random[8]) {
    float before = b.height;
#ifdef RANDOM_QUADS
    vec4 size = species(bladeSpecies(b), SIZE);
    if (own.width_m.x < 0.0) own.width_m = size.zw;
    if (own.height_m.x < 0.0) own.height_m = size.xy;
#endif
    if (own.width_m.x >= 0.0) b.width = between(own.width_m, random[3]);
    if (own.height_m.x >= 0.0) b.height = between(own.height_m, random[4]) * (on_ground ? swardAt(bladeRoot(b).xz).height : 1.0);
    return b.height / before;
}

// Equation 3: above the root, and offset along x and z; what moves the blade from its rest is added (section 5.2)
void offsetAtRandom(Fetched f, vec3 up, vec3 rest, inout vec3 tip, inout vec3 before) {
    vec3 x, z;
    bladeFrame(up, 0.0, z, x);
    vec2 offset = tipOffset(f.own.bending_m, vec2(f.random[1], f.random[2]));
    vec3 own = f.b.height * up + offset.x * x + offset.y * z - rest;
    tip += own;
    before += own;
}

// Left to right: level, as in equation 2, or square to a blade that leans as it was sown
vec3 sideOf(Blade b, vec3 up, vec3 chord) {
#ifdef RANDOM_QUADS
    vec3 front, side;
    bladeFrame(up, b.facing, front, side);
    return side;
#else
    return acrossOf(b, chord);
#endif
}

#ifndef SHADOW
Material ownMaterial(Blade b, BladeBounds h) {
#ifdef SHADED_ALONE
    // section 5.1: the texel or the vegetation map, and nothing of the sward around; at the reach, like the ground beyond
    int kind = bladeSpecies(b);
    vec4 map = on_ground ? paintedAt(bladeRoot(b).xz, 0.0) : vec4(0.0), root = species(kind, ROOT), tip = species(kind, TIP);
    vec3 of_many = mix(tip.rgb, map.rgb, map.a), alone = (own_colours >> uint(kind) & 1u) != 0u ? map.rgb : of_many;
    float missing = 1.0 - partOfBlades(h.away) * partOfHeight(h.away), far = missing * missing;
    vec3 wall = wallNormal(bladeUp(b), toViewerFrom(h.middle));
    return Material(vec4(alone, root.w), vec4(of_many, mix(tip.w, 0.95, far)), 0.0, far, 1.0, wall, map.a);
#else
    return materialOf(b, h, on_ground);
#endif
}
#endif

void main() {
    Fetched f;
    gl_Position = vec4(0.0);
    blade.shape = vec4(0.0);
    if (!fetch(f)) return;
    thinOut(f.b, f.own.density);
    float taller = resize(f.b, f.own, f.random);
    vec3 up = bladeUp(f.b), tip = taller * f.tip, before = taller * f.before;
#ifdef RANDOM_QUADS
    vec3 rest = taller * (bladeTip(f.b) - bladeRoot(f.b));
    offsetAtRandom(f, up, rest, tip, before);
#endif
    vec2 r = vec2(mix(0.75, 1.25, f.random[5]), mix(-0.25, 0.25, f.random[6]));
    float lower = partOfHeight(f.h.away);
    BladeBounds h = f.h;
    h.v1 = h.v0 + lower * controlPoint(vec3(0.0), tip, up, r);
    h.v2 = h.v0 + lower * tip;
    shrinkByFade(h);
    float wide = leafWidth(f.b, h);
    if (wide <= 0.0) return;
    vec3 chord = chordOf(h);

    lower *= h.fade;
    blade.trueSide = sideOf(f.b, up, chord);
    outline(h.v0, drawnSide(blade.trueSide, chord, toViewerFrom(h.middle)), up, wide, lower * f.b.height, blade.corners);
    vec3 offset = lower * (tip - f.b.height * up);
    blade.corners[2] += offset;
    blade.corners[3] += offset;
    blade.before = lower * before;
    blade.up = up;
    blade.shape = vec4(r, f.own.smoothness, bladeRank(f.b));
#ifndef SHADOW
    Material material = ownMaterial(f.b, h);
    blade.material = uvec4(packUnorm4x8(vec4(sqrt(material.root.rgb), material.root.w)), packUnorm4x8(vec4(sqrt(material.tip.rgb), material.tip.w)),
                       packUnorm4x8(vec4(material.tall / 4.0, material.far, material.share, material.mapped)),
                       packSnorm2x16(octahedralEncode(material.wall)));
#endif
    blade.identity = uvec3(f.id, bladeSpecies(f.b), packUnorm4x8(vec4(f.random[1], f.random[3], f.random[5], f.random[6])));
}
