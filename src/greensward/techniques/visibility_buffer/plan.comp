// Workgroups for the lists that raster.comp wrote, and empty lists for its next run.
#include "techniques/visibility_buffer/lists.glsl"

layout(local_size_x = 1) in;

uniform uint rows;  // of the picture

void main() {
    uint chunks = (lists.gathered[WON] + 31u) / 32u;
    lists.large_groups = uint[3](min(lists.gathered[LARGE], 32768u), (rows + 63u) / 64u, 1u);
    lists.won_groups = uint[3](min(chunks, 32768u), (chunks + 32767u) / 32768u, 1u);
    lists.listed = lists.gathered;
    lists.gathered = uint[2](0u, 0u);
}
