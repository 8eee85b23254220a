// What becomes of a blade once it is known where it stands: the same on the ground and on objects.
#include "sowing/sward.glsl"
#include "shaders/blade.glsl"
#include "shaders/bezier.glsl"

struct GrowthPoint {
    vec3 root, up;
    vec3 at, facing;  // where in the drifts
    uvec3 random;     // the blade's own
    uvec3 clump;      // its clump's
    float rank;
    float perM2;      // blades that grow on a square metre here
    Sward sward;
    bool lowDetail, onObject;
};

uvec3 ownChances(uvec3 random) { return hash3(random ^ 0xa511e9b3u); }  // that it grows, its species, its stiffness

bool sprouts(uvec3 random, float share) { return unit(ownChances(random).x) < share; }

int pickSpecies(vec3 at, vec3 facing, float chance) {
    float total = 0.0;
    for (int i = 0; i < sward.count; i++) total += speciesWeight(i, at, facing);
    chance *= total;
    for (int i = 0; i < sward.count - 1; i++) {
        chance -= speciesWeight(i, at, facing);
        if (chance < 0.0) return i;
    }
    return sward.count - 1;
}

float range(vec2 ends, float t) { return mix(ends.x, ends.y, t); }

Blade grown(GrowthPoint point) {
    Sward s = point.sward;
    vec3 root = point.root, up = point.up;
    uvec3 own = ownChances(point.random), more = hash3(point.random ^ 0x63d83595u);
    int kind = pickSpecies(point.at, point.facing, unit(own.y));
    vec4 size = species(kind, SIZE), stance = species(kind, STANCE), habit = species(kind, HABIT);
    float together = sward.clumping;
    vec3 shared3 = unit(hash3(point.clump));
    vec3 alone = unit(more);
    uvec3 last = hash3(point.random ^ 0x1b56c4e9u);
    vec3 spare = unit(last);

    float facing = 6.28318531 * (shared3.x + mix(1.0, 0.22, together) * (alone.x - 0.5));
    vec3 front, side;
    bladeFrame(up, facing, front, side);
    float tall = clamp(mix(alone.y, 0.6 * alone.y + 0.4 * shared3.y, together), 0.0, 1.0);
    float height = max(range(size.xy, tall) * s.height, 1e-3);
    float tilt = range(stance.zw, clamp(mix(alone.z, 0.65 * alone.z + 0.35 * shared3.z, together), 0.0, 1.0));
    float arch = range(habit.xy, spare.x);

    vec3 v1, v2;
    vec3 lean = cos(tilt) * up + sin(tilt) * front;
    vec3 across = sin(tilt) * up - cos(tilt) * front;
    v2 = root + height * lean;
    v1 = root + height * (0.5 * lean + 0.5 * arch * across);
    correctLength(root, v1, v2, height);

    float dry = clamp(range(habit.zw, clamp(s.dryness + 0.35 * (spare.y - 0.5) + 0.25 * together * (shared3.y - 0.5), 0.0, 1.0)), 0.0, 1.0);
    bool head = unit(hash3(last).x) < species(kind, DRY).w;
    float tint = clamp(mix(spare.z, 0.5 * spare.z + 0.5 * shared3.z, together), 0.0, 1.0);

    Blade blade;
    blade.x = root.x; blade.y = root.y; blade.z = root.z;
    blade.facing = facing;
    blade.x1 = v1.x; blade.y1 = v1.y; blade.z1 = v1.z;
    blade.height = height;
    blade.x2 = v2.x; blade.y2 = v2.y; blade.z2 = v2.z;
    blade.width = range(size.zw, 0.5 * tall + 0.5 * unit(last.y));
    blade.up = packSnorm2x16(octahedralEncode(up));
    blade.stiffness = range(stance.xy, unit(own.z));
    blade.flags = uint(kind) | (head ? BLADE_HEAD : 0u) | (point.lowDetail ? BLADE_LOW_DETAIL : 0u)
        | (point.onObject ? BLADE_ON_OBJECT : 0u) | uint(dry * 255.0 + 0.5) << 8u | uint(tint * 255.0 + 0.5) << 16u
        | uint(clamp(8.0 * log2(max(point.perM2 * sward.blade_m.x * s.height, 1e-9)) + 80.5, 0.0, 255.0)) << 24u;
    blade.chance = packUnorm2x16(vec2(sqrt(point.rank), unit(hash3(last).y)));
    return blade;
}
