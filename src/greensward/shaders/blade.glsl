// Accessors of a blade, and its pose packed in halfs.
#include "layout/Blade"
#include "layout/Pose"
#include "layout/BladeBits"
#include "layout/BladeFlag"
#include "shaders/octahedral.glsl"

vec3 bladeRoot(Blade b) { return vec3(b.x, b.y, b.z); }
vec3 bladeControl(Blade b) { return vec3(b.x1, b.y1, b.z1); }
vec3 bladeTip(Blade b) { return vec3(b.x2, b.y2, b.z2); }
vec3 bladeUp(Blade b) { return octahedralDecode(unpackSnorm2x16(b.up)); }
int bladeSpecies(Blade b) { return int(b.flags & SPECIES_MASK); }
bool hasHead(Blade b) { return (b.flags & BLADE_HEAD) != 0u; }
bool isLowDetail(Blade b) { return (b.flags & BLADE_LOW_DETAIL) != 0u; }
bool isOnObject(Blade b) { return (b.flags & BLADE_ON_OBJECT) != 0u; }
float bladeDryness(Blade b) { return unpackUnorm4x8(b.flags).y; }
float bladeTint(Blade b) { return unpackUnorm4x8(b.flags).z; }
// Metres of blade that grow on a square metre around it
float bladeCrowding(Blade b) { return exp2(0.125 * float(b.flags >> 24u) - 10.0); }
float bladeRank(Blade b) { float root = unpackUnorm2x16(b.chance).x; return root * root; }
float bladeRandom(Blade b) { return unpackUnorm2x16(b.chance).y; }

uint[3] packPose(vec3 control, vec3 tip) {
    return uint[3](packHalf2x16(control.xy), packHalf2x16(vec2(control.z, tip.x)), packHalf2x16(tip.yz));
}

void unpackPose(uint[3] bits, vec3 root, out vec3 control, out vec3 tip) {
    vec2 a = unpackHalf2x16(bits[0]), b = unpackHalf2x16(bits[1]), c = unpackHalf2x16(bits[2]);
    control = root + vec3(a, b.x);
    tip = root + vec3(b.y, c);
}

// Front and side of a blade that faces `facing` about `up`
void bladeFrame(vec3 up, float facing, out vec3 front, out vec3 side) {
    vec3 helper = abs(up.x) < 0.9 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 0.0, 1.0);
    vec3 e1 = normalize(cross(helper, up)), e2 = cross(up, e1);
    front = cos(facing) * e1 + sin(facing) * e2;
    side = cross(up, front);
}
