// Copies roots of some tiles of a page into textures, and finds the neighbours of each in its tile.
#include "techniques/expanded_roots/roots.glsl"
#include "layout/RootRun"
#include "shaders/dispatch.glsl"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) readonly buffer Runs { RootRun runs[]; };  // by those before them

layout(rgba32ui) writeonly uniform uimage2DArray roots_image;

uniform int run_count;
uniform int root_count;
uniform int texture_width;

RootRun runAt(uint number) {
    int low = 0, high = run_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (runs[middle].before <= number) low = middle; else high = middle - 1;
    }
    return runs[low];
}

#ifdef NEIGHBOURS
// Roots that are looked at: those that follow in the tile, any run of which is a fair sample of it
const uint WINDOW = 2048u;
const float STEEPEST = 2.0;  // beyond that another side of an object

vec3 placeOf(uint root) { return vec3(blades[root].x, blades[root].y, blades[root].z); }

// The nearest in each quadrant
uvec4 neighboursOf(Blade b, uint within, RootRun run) {
    vec3 root = bladeRoot(b), normal, first, second;
    groundAround(b, normal, first, second);
    vec4 nearest = vec4(1e30);
    uvec4 found = uvec4(NONE);
    for (uint i = 1u; i < min(WINDOW, run.count); i++) {
        uint other = run.first + (within + i) % run.count;
        vec3 away = placeOf(other) - root;
        vec2 place = vec2(dot(away, first), dot(away, second));
        int quadrant = quadrantOf(place);
        float far = dot(place, place);
        if (far >= nearest[quadrant] || far == 0.0) continue;
        float above = dot(away, normal);
        if (above * above > STEEPEST * STEEPEST * far) continue;
        nearest[quadrant] = far;
        found[quadrant] = other;
    }
    return found;
}
#endif

void main() {
    uint number = workgroupIndex() * 64u + gl_LocalInvocationID.x;
    if (number >= uint(root_count)) return;
    RootRun run = runAt(number);
    uint within = number - run.before, root = run.first + within;
    Blade b = blades[root];
    ivec2 at = texelOf(root, texture_width);
    imageStore(roots_image, ivec3(at, 0), floatBitsToUint(vec4(b.x, b.y, b.z, b.facing)));
    imageStore(roots_image, ivec3(at, 1), floatBitsToUint(vec4(b.x1, b.y1, b.z1, b.height)));
    imageStore(roots_image, ivec3(at, 2), floatBitsToUint(vec4(b.x2, b.y2, b.z2, b.width)));
    imageStore(roots_image, ivec3(at, 3), uvec4(b.up, floatBitsToUint(b.stiffness), b.flags, b.chance));
#ifdef NEIGHBOURS
    imageStore(roots_image, ivec3(at, 4), neighboursOf(b, within, run));
#endif
}
