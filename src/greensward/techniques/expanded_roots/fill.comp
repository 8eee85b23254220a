// Copies roots of some tiles of a page into textures, and finds the neighbours of each in its tile.
#include "techniques/expanded_roots/cells.glsl"
#include "techniques/expanded_roots/roots.glsl"

layout(local_size_x = 64) in;

layout(rgba32ui) writeonly uniform uimage2DArray roots_image;

uniform int texture_width;

#ifdef NEIGHBOURS
layout(std430) readonly buffer Cells { uint cells[]; };

const int AROUND = 4;        // cells to each side that are looked at
const float STEEPEST = 2.0;  // beyond that another side of an object

// The nearest in each quadrant, of one root of every cell
uvec4 neighboursOf(Blade b, uint run, uint self) {
    vec3 root = bladeRoot(b), normal, first, second;
    groundAround(b, normal, first, second);
    vec4 nearest = vec4(1e30);
    uvec4 found = uvec4(NO_ROOT);
    ivec2 here = cellAt(runs[run], root), low = max(here - AROUND, 0), high = min(here + AROUND, ROOT_CELLS - 1);
    for (int y = low.y; y <= high.y; y++) {
        for (int x = low.x; x <= high.x; x++) {
            uint other = cells[numberOf(run, ivec2(x, y))];
            if (other == NO_ROOT || other == self) continue;
            vec3 away = placeOf(other) - root;
            vec2 place = vec2(dot(away, first), dot(away, second));
            float far = dot(place, place), above = dot(away, normal);
            int quadrant = quadrantOf(place);
            if (far >= nearest[quadrant] || far == 0.0 || above * above > STEEPEST * STEEPEST * far) continue;
            nearest[quadrant] = far;
            found[quadrant] = other;
        }
    }
    return found;
}
#endif

void main() {
    uint run, root;
    if (!takeRoot(run, root)) return;
    Blade b = blades[root];
    ivec2 at = texelOf(root, texture_width);
    imageStore(roots_image, ivec3(at, 0), floatBitsToUint(vec4(b.x, b.y, b.z, b.facing)));
    imageStore(roots_image, ivec3(at, 1), floatBitsToUint(vec4(b.x1, b.y1, b.z1, b.height)));
    imageStore(roots_image, ivec3(at, 2), floatBitsToUint(vec4(b.x2, b.y2, b.z2, b.width)));
    imageStore(roots_image, ivec3(at, 3), uvec4(b.up, floatBitsToUint(b.stiffness), b.flags, b.chance));
#ifdef NEIGHBOURS
    imageStore(roots_image, ivec3(at, 4), neighboursOf(b, run, root));
#endif
}
