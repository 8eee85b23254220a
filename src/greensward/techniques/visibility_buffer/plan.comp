// Workgroups for the lists that raster.comp wrote, and empty lists for its next run.
#include "techniques/visibility_buffer/lists.glsl"

layout(local_size_x = 1) in;

uniform uint rows;  // of the picture

void main() {
    uint chunks = (gathered[WON] + 31u) / 32u;
    largeGroups = uint[3](min(gathered[LARGE], 32768u), (rows + 63u) / 64u, 1u);
    wonGroups = uint[3](min(chunks, 32768u), (chunks + 32767u) / 32768u, 1u);
    listed = gathered;
    gathered = uint[2](0u, 0u);
}
