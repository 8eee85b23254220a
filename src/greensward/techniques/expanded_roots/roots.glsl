// Roots as four vectors of 32 bits each: position and facing; control point and height; tip and width; up, stiffness, colour
// and chances. They are the fields of `Blade`, in order.
#include "shaders/blade.glsl"
#include "techniques/expanded_roots/extra.glsl"

Blade rootOf(uvec4 a, uvec4 b, uvec4 c, uvec4 d) {
    Blade r;
    vec4 p = uintBitsToFloat(a), q = uintBitsToFloat(b), t = uintBitsToFloat(c);
    r.x = p.x; r.y = p.y; r.z = p.z; r.facing = p.w;
    r.x1 = q.x; r.y1 = q.y; r.z1 = q.z; r.height = q.w;
    r.x2 = t.x; r.y2 = t.y; r.z2 = t.z; r.width = t.w;
    r.up = d.x; r.stiffness = uintBitsToFloat(d.y); r.flags = d.z; r.chance = d.w;
    return r;
}

// Section 2.1.2: one-dimensional arrays, here folded into rows where they are longer than a texture is wide
ivec2 texelOf(uint root, int width) { return ivec2(int(root) % width, int(root) / width); }

// Of the ground, by the up of a blade, which sowing/ground_blade.glsl turns from the vertical to the normal by this part
const float TURNED_BY = 0.35;

vec3 normalUnder(vec3 up) {
    const float KEPT = 1.0 - TURNED_BY;
    float along = KEPT * up.y + sqrt(max(KEPT * KEPT * up.y * up.y - KEPT * KEPT + TURNED_BY * TURNED_BY, 0.0));
    return normalize(along * up - vec3(0.0, KEPT, 0.0));
}

// The surface around a root: its normal and two directions along it
void groundAround(Blade b, out vec3 normal, out vec3 first, out vec3 second) {
    normal = isOnObject(b) ? bladeUp(b) : normalUnder(bladeUp(b));
    bladeFrame(normal, 0.0, first, second);
}
