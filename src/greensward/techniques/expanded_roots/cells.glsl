// Roots of some tiles of a page, run by run in workgroups of 64, and a grid of cells over each, with one root of every cell.
#include "shaders/blade.glsl"
#include "shaders/dispatch.glsl"
#include "layout/RootRun"
#include "layout/RootCells"

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) readonly buffer Runs { RootRun runs[]; };  // by the number of roots before them

uniform int run_count;
uniform int root_count;

const uint NO_ROOT = 0xffffffffu;

// False beyond the last
bool takeRoot(out uint run, out uint root) {
    uint number = workgroupIndex() * 64u + gl_LocalInvocationID.x;
    if (number >= uint(root_count)) return false;
    int low = 0, high = run_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (runs[middle].before <= number) low = middle; else high = middle - 1;
    }
    run = uint(low);
    root = runs[low].first + number - runs[low].before;
    return true;
}

vec3 placeOf(uint root) { return vec3(blades[root].x, blades[root].y, blades[root].z); }

// Along the two longer edges of the tile's box
ivec2 cellAt(RootRun run, vec3 place) {
    vec2 across = run.dropped == 0u ? place.yz : run.dropped == 1u ? place.xz : place.xy;
    return clamp(ivec2((across - vec2(run.corner_x, run.corner_y)) * run.cells_per_m), 0, ROOT_CELLS - 1);
}

uint numberOf(uint run, ivec2 cell) { return (run * uint(ROOT_CELLS) + uint(cell.y)) * uint(ROOT_CELLS) + uint(cell.x); }
