// One plant for each cell of a grid around the camera: procedural, so that the same plant stands at the same place
// whatever the camera, and nothing is stored.
#include "sowing/sward.glsl"
#include "motion/pose.glsl"
#include "shaders/dispatch.glsl"
#include "layout/Flower"

layout(local_size_x = 64) in;

layout(std430) writeonly buffer Flowers { Flower flowers[]; };

uniform ivec2 first_cell;
uniform int cells;  // along a side of the grid
uniform int first_place;  // of those that the buffer holds
uniform int places;
uniform float cell_m;
uniform ivec2 anchor_cell;  // in which the anchor lies, and where in it
uniform vec2 in_cell;
uniform uint salt;
uniform vec2 height_m;
uniform float aspect;      // width over height
uniform float patchiness;
uniform float stiffness;
uniform float reach_m;
uniform vec3 focus_ws;
uniform float time_s;
uniform float previous_time_s;

Flower nothing() { return Flower(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)); }

bool growsAt(vec2 xz, float normalY, float chance) {
    Sward s = swardAt(xz);
    float drift = smoothstep(-0.25, 0.45, octaves(inWorld(xz) / sward.drift_m, sward.seed + salt, 3, 0.6, 2.7));
    return chance < s.density * slopeShare(normalY) * mix(1.0, 1.6 * drift * drift, patchiness);
}

Flower growIn(ivec2 cell) {
    uvec3 bits = hash3(uvec3(uvec2(cell), sward.seed ^ salt)), more = hash3(bits);
    vec2 xz = (vec2(cell - anchor_cell) + unit(bits).xy - in_cell) * cell_m;
    vec3 root = vec3(xz.x, groundHeight(xz), xz.y);
    float away = distance(root, focus_ws);
    if (away >= reach_m || !growsAt(xz, groundNormal(xz).y, unit(bits.z))) return nothing();
    float height = mix(height_m.x, height_m.y, unit(more.x)) * (1.0 - smoothstep(0.75, 1.0, away / reach_m));

    // a stem that stands nearly upright and sways as a blade of grass does
    vec3 lean = normalize(vec3(0.3 * (unit(more.y) - 0.5), 1.0, 0.3 * (unit(more.z) - 0.5))) * height;
    Blade b;
    b.x = root.x; b.y = root.y; b.z = root.z;
    b.facing = 6.28318531 * unit(more.y);
    b.x1 = root.x; b.y1 = root.y + 0.5 * height; b.z1 = root.z;
    b.x2 = root.x + lean.x; b.y2 = root.y + lean.y; b.z2 = root.z + lean.z;
    b.height = max(height, 1e-3);
    b.width = 0.01;
    b.up = packSnorm2x16(octahedralEncode(vec3(0.0, 1.0, 0.0)));
    b.stiffness = stiffness;
    b.flags = 0u;
    b.chance = packUnorm2x16(vec2(0.5, unit(more.z)));
    vec3 control, tip, controlBefore, tipBefore;
    bentControlPoints(b, time_s, control, tip);
    bentControlPoints(b, previous_time_s, controlBefore, tipBefore);
    float mirrored = unit(more.z) < 0.5 ? -1.0 : 1.0;
    return Flower(vec4(root, height), vec4(control, mirrored * aspect * height), vec4(tip, unit(more.y)),
                  vec4(controlBefore, 0.0), vec4(tipBefore, 0.0));
}

void main() {
    int index = int(64u * workgroupIndex() + gl_LocalInvocationID.x);
    if (index >= places) return;
    int place = first_place + index;
    flowers[index] = growIn(first_cell + ivec2(place % cells, place / cells));
}
