// Finds the first root in each cell of the grids of some tiles.
#include "techniques/expanded_roots/cells.glsl"

layout(local_size_x = 64) in;

layout(std430) buffer Cells { uint cells[]; };  // all NO_ROOT before

void main() {
    uint run, root;
    if (takeRoot(run, root)) atomicMin(cells[numberOf(run, cellAt(runs[run], placeOf(root)))], root);
}
