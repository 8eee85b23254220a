// Makes the blades of a root: each a strip along the trajectory of a particle, bent by what moves it, with fewer points the
// farther it is (Tillman 2013, sections 2.1.2 to 2.1.4).
#include "culling/bounds.glsl"
#include "culling/tests.glsl"
#ifdef OCCLUSION
#include "culling/occlusion.glsl"
#endif
#include "techniques/blades/blade_material.glsl"
#include "techniques/blades/normal.glsl"
#include "techniques/expanded_roots/roots.glsl"
#include "techniques/expanded_roots/line.glsl"
#include "layout/Pose"

#ifdef INVOCATIONS
layout(points, invocations = INVOCATIONS) in;
#else
layout(points) in;
#endif
layout(triangle_strip, max_vertices = VERTICES) out;

flat in uint number[];

layout(std430) readonly buffer Poses { Pose poses[]; };

uniform vec3 levels_m;
uniform float fade;
uniform ivec3 lines;        // points of the middle line, by level
uniform vec3 broader;       // by level: what keeps a blade's area where its outline has fewer points
uniform vec2 widths;        // at the root and below the tip, in widths of the blade
uniform float spacing_m;    // between roots
uniform uint first_blade_number;
uniform uint numbers_of_each;   // between the ids of a root's blades
uniform bool on_ground;     // where the vegetation map lies

#ifndef SHADOW
uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space

layout(std430) buffer Drawn { uint drawn[]; };  // blades, summed in 1,024 parts

out vec4 normalAndHeight;    // w runs from 0 at the root to 1 at the tip
out vec3 previousClip;       // x, y, w
flat out uvec4 look;         // colours of root and tip, shading, id
#endif

#ifdef TEXTURES
uniform usampler2DArray roots_texture;
uniform int texture_width;

uvec4 valuesOf(uint root, int layer) { return texelFetch(roots_texture, ivec3(texelOf(root, texture_width), layer), 0); }

Blade rootAt(uint root) { return rootOf(valuesOf(root, 0), valuesOf(root, 1), valuesOf(root, 2), valuesOf(root, 3)); }

Blade thisRoot() { return rootAt(number[0]); }
#else
flat in uvec4 rootPlace[], rootControl[], rootTip[], rootHabit[];

Blade thisRoot() { return rootOf(rootPlace[0], rootControl[0], rootTip[0], rootHabit[0]); }
#endif

const uint NO_ROOT = 0xffffffffu;

// What moves a blade: its control point and tip, now and one frame ago, from the root
struct Moved { vec3 control, tip, controlBefore, tipBefore; };

#if EXTRA > 0
#include "techniques/expanded_roots/spread.glsl"

#ifdef TEXTURES
// A neighbour as a root's frame has it: where it is, and how the land around it rises there
struct Neighbour { Blade blade; vec2 at; float above; vec2 slope; };

Neighbour neighbourOf(Blade b, uint other, mat3 frame) {
    if (other == NO_ROOT) return Neighbour(b, vec2(0.0), 0.0, vec2(0.0));
    Blade n = rootAt(other);
    vec3 normal, first, second;
    groundAround(n, normal, first, second);
    vec3 place = (bladeRoot(n) - bladeRoot(b)) * frame, up = normal * frame;
    return Neighbour(n, place.xy, place.z, -up.xy / max(up.z, 0.2));
}
#endif

// Extra blade k of a root with neighbours around it: as far from it as the density asks, turned and sized a little otherwise
void standBeside(int k, uvec4 around, inout Blade b, inout Moved m) {
    vec3 normal, first, second;
    groundAround(b, normal, first, second);
    uvec3 bits = hash3(uvec3(b.chance >> 16u, b.flags & ~BLADE_HEAD, uint(k)));
    vec3 random = unit(bits);
    vec2 at = offsetOf(k, EXTRA, spacing_m, bladeRandom(b));
    vec3 moved = at.x * first + at.y * second;
    Blade own = b;
#ifdef TEXTURES
    int quadrant = quadrantOf(at);
    mat3 frame = mat3(first, second, normal);
    Neighbour a = neighbourOf(own, around[quadrant], frame);
    bool after = a.at.x * at.y - a.at.y * at.x >= 0.0;
    Neighbour c = neighbourOf(own, around[(quadrant + (after ? 1 : 3)) & 3], frame);
    vec2 parts = partsBetween(at, a.at, c.at);
    moved += (parts.x * heightFrom(at, a.at, a.above, a.slope) + parts.y * heightFrom(at, c.at, c.above, c.slope)) * normal;
    blend(b, own, a.blade, c.blade, parts);
#endif
    vary(b, own, moved, random, bits.z);
    float longer = b.height / max(own.height, 1e-6);
    vec3 control = bladeControl(own) - bladeRoot(own), tip = bladeTip(own) - bladeRoot(own);
    vec3 controlOfOwn = bladeControl(b) - bladeRoot(b), tipOfOwn = bladeTip(b) - bladeRoot(b);
    m.control = controlOfOwn + longer * (m.control - control);
    m.controlBefore = controlOfOwn + longer * (m.controlBefore - control);
    m.tip = tipOfOwn + longer * (m.tip - tip);
    m.tipBefore = tipOfOwn + longer * (m.tipBefore - tip);
}
#endif

#ifndef ALL_DISTANCES
// Section 2.1.4: by the distance of the root; from the last level's on, none
int levelAt(float away) { return away < levels_m.x ? 0 : away < levels_m.y ? 1 : 2; }

float leftAt(float away) {
    return away >= levels_m.z ? 0.0 : min((levels_m.z - away) / max(fade * levels_m.z, 1e-6), 1.0);
}
#endif

bool isSeen(BladeBounds h, vec3 line[LINE], int count, float wide) {
#ifdef ORIENTATION
    if (wide == 0.0) return false;
#endif
    float beside = max(max(widths.x, widths.y), 1.0) * wide;
    vec3 one = line[1];
    for (int i = 2; i < count - 1; i++) beside = max(beside, max(max(widths.x, widths.y), 1.0) * wide + distance(one, line[i]));
#ifdef FRUSTUM
    if (outside(line[0], one, line[count - 1], beside)) return false;
#endif
#ifdef OCCLUSION
    if (hidden(line[0], one, line[count - 1], beside)) return false;
#endif
    return true;
}

void make(Blade b, Moved m, uint id) {
    BladeBounds h;
    if (!startBounds(b, h)) return;
    int level = 0;
#ifndef ALL_DISTANCES
    level = levelAt(h.away);
    h.fade *= leftAt(h.away);
    if (h.fade <= 0.0) return;
#endif
    int count = lines[level];
    vec3 line[LINE];
    lineOf(b, m.control, m.tip, count, line);
    for (int i = 0; i < count; i++) line[i] = h.v0 + h.fade * line[i];
    h.v1 = line[1];
    h.v2 = line[count - 1];
    h.middle = 0.5 * (line[(count - 1) / 2] + line[count / 2]);
    h.pixel = view.pixel_m.x * max(dot(view.axis_rs.xyz, h.middle) + view.axis_rs.w, 0.02) + view.pixel_m.y;
    float wide = leafWidth(b, h);
    if (wide < 0.0) return;
    wide *= broader[level];
    if (!isSeen(h, line, count, wide)) return;

    vec3 chord = chordOf(h), across = acrossOf(b, chord), side = drawnSide(across, chord, toViewerFrom(h.middle));
#ifndef SHADOW
    atomicAdd(drawn[id & 1023u], 1u);
    vec3 before[LINE];
    lineOf(b, m.controlBefore, m.tipBefore, count, before);
    Material material = materialOf(b, h, on_ground);
    uvec3 coded = uvec3(packUnorm4x8(vec4(sqrt(material.root.rgb), material.root.w)), packUnorm4x8(vec4(sqrt(material.tip.rgb), material.tip.w)),
                         packUnorm4x8(vec4(material.tall / 4.0, material.far, material.share, 0.0)));
#endif
    for (int i = 0; i < count; i++) {
        bool isTip = i == count - 1;
        float width = isTip ? 0.0 : wide * widthAt(i, count - 2, widths.x, widths.y), v = float(i) / float(count - 1);
        vec3 along = normalize(line[min(i + 1, count - 1)] - line[max(i - 1, 0)]);
        for (int edge = 0; edge < (isTip ? 1 : 2); edge++) {
            float u = isTip ? 0.5 : float(edge);
            vec3 offset = (u - 0.5) * width * side, p = line[i] + offset;
            gl_Position = view.jittered_clip_from_relative * vec4(p, 1.0);
#ifndef SHADOW
            vec4 previous_rs = previous_from_now * vec4(h.v0 + h.fade * before[i] + offset, 1.0);
            previousClip = (view.previous_clip_from_relative * previous_rs).xyw;
            vec3 toEye = view.eye_rs.xyz - p * view.eye_rs.w;
            normalAndHeight = vec4(leafNormal(across, side, along, toEye, u, material.wall, material.far), v);
            look = uvec4(coded, id);
#endif
            EmitVertex();
        }
    }
    EndPrimitive();
}

void makeBlade(int k, uvec4 around, Blade b, Moved m) {
#if EXTRA > 0
    if (k > 0) standBeside(k, around, b, m);
#endif
    make(b, m, first_blade_number + number[0] + uint(k) * numbers_of_each);
}

void main() {
    Blade b = thisRoot();
    b.flags = b.flags & 0xffffffu | min((b.flags >> 24u) + CROWDED, 255u) << 24u;
    Pose pose = poses[number[0]];
    Moved m;
    unpackPose(pose.now, vec3(0.0), m.control, m.tip);
    unpackPose(pose.previous, vec3(0.0), m.controlBefore, m.tipBefore);
    uvec4 around = uvec4(NO_ROOT);
#if EXTRA > 0 && defined(TEXTURES)
    around = valuesOf(number[0], 4);
#endif
#ifdef INVOCATIONS
    makeBlade(gl_InvocationID, around, b, m);
#else
    for (int k = 0; k <= EXTRA; k++) makeBlade(k, around, b, m);
#endif
}
