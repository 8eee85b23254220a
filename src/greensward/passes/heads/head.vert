// Head of a blade: a mesh, or far away a triangle, on objects with another one as its stem; beside it, heads of blades that distance leaves out.
#include "passes/heads/head.glsl"
#include "passes/heads/tables"
#include "layout/HeadVertex"

layout(std430) readonly buffer Listed { uint listed[]; };  // blades of all levels
layout(std430) readonly buffer Meshes { HeadVertex mesh[]; };

const float GOLDEN = 2.39996323;
const float STEM = 0.4;           // part of the blade, from its tip down, that is drawn as a stem
const float STEM_WIDTH = 0.45;    // in widths of the blade, of which its outline leaves less and less
const float STEM_LEAST_PX = 0.6;

uniform int level;
uniform uint room;       // for the heads of a level
uniform int heads_each;  // as which one may be drawn

#ifndef SHADOW
out vec3 position_rs;
out vec3 colour;
out vec3 normal_ws;
out vec4 previousClip;
flat out uint blade;
flat out uint isFlower;

uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space
#endif

// From the blade's own head to the place of another one of its species, which is somewhere near
vec3 toMember(Blade b, int member) {
    if (member == 0) return vec3(0.0);
    float turn = 6.2832 * bladeRandom(b) + GOLDEN * float(member);
    vec2 xz = apart(bladeSpecies(b)) * spread(float(member)) * vec2(cos(turn), sin(turn));
    vec3 up = groundUnder(b);
    return vec3(xz.x, -dot(up.xz, xz) / max(up.y, 0.1), xz.y);
}

// Area that a head shows to a viewer, in sizes squared
float outline(int kind, float along) { return length(outlines[kind] * vec2(sqrt(max(1.0 - along * along, 0.0)), along)); }

// Three corners that cover what a head shows, upright along its axis as it is seen
vec3 farCorner(int corner, vec3 axis, vec3 toViewer, float area, float wide, float tall) {
    vec3 side = cross(axis, toViewer);
    float slant = length(side);
    side = slant > 1e-3 ? side / slant : normalize(cross(axis.yzx, toViewer));
    vec3 upwards = cross(toViewer, side);
    wide = min(wide, 2.0 * area / max(tall * slant, 1e-6));
    float reach = 2.0 * area / max(wide, 1e-6);
    return corner == 2 ? upwards * reach : side * wide * (float(corner) - 0.5);
}

const vec2 farStem[] = vec2[](vec2(-2.0, 0.0), vec2(2.0, 0.0), vec2(0.0, 2.0));

// On the ribbon along the upper end of the blade that joins it to its head: across it from -1 to 1, down it from 0 to 1
vec3 stemCorner(Head h, vec2 corner, vec3 toViewer, float depth_m) {
    vec3 v1 = mix(h.root, h.v1, h.fade);
    float t = 1.0 - STEM * corner.y;
    float wide = max(STEM_WIDTH * h.blade.width, STEM_LEAST_PX * (view.pixel_m.x * depth_m + view.pixel_m.y));
    vec3 across = cross(bezierTangent(h.root, v1, h.tip, t), toViewer);
    return bezierPoint(h.root, v1, h.tip, t) - h.tip + 0.5 * corner.x * wide * across / max(length(across), 1e-6);
}

void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    bool isStem = level == FAR && gl_VertexID >= 3 * heads_each;
    int member = isStem ? 0 : level == FAR ? gl_VertexID / 3 : gl_InstanceID % heads_each;
    uint index = listed[uint(level) * room + uint(level == FAR ? gl_InstanceID : gl_InstanceID / heads_each)];
    Head h;
    findHead(index, h);
    Blade b = h.blade;
    // all that it stands for are drawn, as far as they may
    float part = member == 0 ? 1.0 : sqrt(clamp(h.each - float(member), 0.0, 1.0));
    if (part <= 0.0) return;
    int kindOfGrass = bladeSpecies(b), kind = int(species(kindOfGrass, MIX).w);
    vec2 grown = part * grownSize(h, float(heads_each));
    vec3 at = h.tip + toMember(b, member);
    float random = fract(bladeRandom(b) + 0.618034 * float(member));

    vec3 up = bladeUp(b), tangent = normalize(h.v2 - h.v1);
    vec3 wander = vec3(cos(6.2832 * random), 0.0, sin(6.2832 * random));
    // flowers turn up, each a little to a side of its own; seed heads go on along the stem and nod
    vec3 axis = h.flower ? normalize(0.5 * tangent + up + (0.15 + 0.75 * fract(random * 57.31)) * wander)
                         : normalize(tangent - 0.12 * up + 0.12 * wander);
    vec3 offset, normal;
    vec2 paint;  // heart and stem, as parts of the colour
    vec2 stem;   // which corner of it
    float shade;
    vec3 eye = view.eye_rs.xyz - at * view.eye_rs.w, toViewer = normalize(eye);
    if (level == FAR) {
        float area = outline(kind, dot(axis, toViewer)) * grown.x * grown.y;
        offset = farCorner(gl_VertexID % 3, axis, toViewer, area, h.flower ? grown.x : 0.5 * grown.x, grown.y);
        normal = axis + toViewer;
        paint = far_paint[kind];
        shade = 0.94;
        stem = farStem[gl_VertexID % 3];
    } else {
        HeadVertex corner = mesh[kind * VERTICES + levels[level].x + gl_VertexID];
        if (corner.normal.xyz == vec3(0.0)) return;  // padding of the mesh
        isStem = corner.place.w < 0.0;
        stem = corner.place.xy;
        vec3 helper = abs(axis.y) < 0.95 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
        vec3 e1 = normalize(cross(helper, axis)), e3 = cross(axis, e1);
        float turn = 6.2832 * fract(random * 13.7);
        mat3 frame = mat3(cos(turn) * e1 + sin(turn) * e3, axis, cos(turn) * e3 - sin(turn) * e1);
        offset = frame * (corner.place.xyz * grown.xyx);
        normal = frame * corner.normal.xyz;
        paint = vec2(corner.place.w, corner.normal.w);
        shade = mix(0.8, 1.0, clamp(corner.place.y * 2.0 + 0.3, 0.0, 1.0));
    }
    if (isStem) {
        offset = stemCorner(h, stem, toViewer, length(eye));
        normal = toViewer + up;
        paint = vec2(0.0, 1.0);
        shade = 1.0;
    } else if (!h.flower) {
        offset -= axis * 0.12 * grown.y;
    }
    gl_Position = view.jittered_clip_from_relative * vec4(at + offset, 1.0);
#ifndef SHADOW
    position_rs = at + offset;
    vec3 previousControl, previousTip;
    unpackPose(poses[index].previous, h.root, previousControl, previousTip);
    vec4 previous_rs = previous_from_now * vec4(position_rs + mix(h.root, previousTip, h.fade) - h.tip, 1.0);
    previousClip = view.previous_clip_from_relative * previous_rs;
    normal_ws = normal;
    vec3 petals = mix(species(kindOfGrass, HEAD).rgb, species(kindOfGrass, HEART).rgb, paint.x);
    vec3 tint = (bladeTint(b) - 0.5) * (h.flower ? vec3(0.35, 0.7, 0.3) : vec3(0.5));
    colour = mix(petals, species(kindOfGrass, TIP).rgb, paint.y) * (1.0 + tint) * shade;
    blade = index;
    isFlower = h.flower && !isStem ? 1u : 0u;
#endif
}
