// Chunks of a table: consecutive items of a page, at most 32.
#include "layout/Chunk"

layout(std430) readonly buffer Chunks { Chunk chunks[]; };

uniform int first_chunk;
