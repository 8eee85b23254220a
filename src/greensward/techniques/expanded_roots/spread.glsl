// What an extra blade takes over from its root and, with textures, from neighbouring roots.
#include "shaders/blade.glsl"
#include "techniques/expanded_roots/extra.glsl"

// Without a neighbour the root's own plane goes on
vec2 partsBetween(vec2 at, vec2 a, vec2 b) {
    bool hasA = dot(a, a) > 0.0, hasB = dot(b, b) > 0.0;
    if (hasA && hasB) return partsOf(at, a, b);
    return vec2(hasA ? clamp(dot(at, a) / dot(a, a), 0.0, 1.0) : 0.0, hasB ? clamp(dot(at, b) / dot(b, b), 0.0, 1.0) : 0.0);
}

float between(float own, float a, float b, vec2 parts) { return own + parts.x * (a - own) + parts.y * (b - own); }

// Height, width, dryness, tint and crowding; the species stays
void blend(inout Blade b, Blade own, Blade a, Blade c, vec2 parts) {
    b.height = between(own.height, a.height, c.height, parts);
    if (bladeSpecies(a) == bladeSpecies(own) && bladeSpecies(c) == bladeSpecies(own)) b.width = between(own.width, a.width, c.width, parts);
    vec4 x = unpackUnorm4x8(own.flags), y = unpackUnorm4x8(a.flags), z = unpackUnorm4x8(c.flags);
    uint mixed = packUnorm4x8(x + parts.x * (y - x) + parts.y * (z - x));
    b.flags = own.flags & 0xffu | mixed & 0xffffff00u;
}

// Its own turn, size, tint and random number, moved from the root
void vary(inout Blade b, Blade own, vec3 moved, vec3 random, uint bits) {
    vec3 up = bladeUp(own), front, side, newFront, newSide;
    bladeFrame(up, own.facing, front, side);
    b.facing = own.facing + 2.4 * (random.x - 0.5);
    bladeFrame(up, b.facing, newFront, newSide);
    b.height *= mix(0.8, 1.2, random.y);
    float taller = b.height / max(own.height, 1e-6);
    vec3 control = bladeControl(own) - bladeRoot(own), tip = bladeTip(own) - bladeRoot(own), root = bladeRoot(own) + moved;
    control = root + taller * (dot(control, up) * up + dot(control, front) * newFront + dot(control, side) * newSide);
    tip = root + taller * (dot(tip, up) * up + dot(tip, front) * newFront + dot(tip, side) * newSide);
    b.x = root.x; b.y = root.y; b.z = root.z;
    b.x1 = control.x; b.y1 = control.y; b.z1 = control.z;
    b.x2 = tip.x; b.y2 = tip.y; b.z2 = tip.z;
    vec4 flags = unpackUnorm4x8(b.flags);
    flags.z = clamp(flags.z + 0.5 * (random.z - 0.5), 0.0, 1.0);
    b.flags = (packUnorm4x8(flags) & 0xffffff00u | b.flags & 0xffu) & ~BLADE_HEAD;
    b.chance = b.chance & 0xffffu | bits & 0xffff0000u;
}
