// A workgroup takes a chunk, an invocation an item.
#include "culling/chunks.glsl"
#include "shaders/dispatch.glsl"

uniform int chunk_count;

// False beyond the last item
bool takeItem(out uint index) {
    uint chunk = workgroupIndex();
    if (chunk >= uint(chunk_count)) return false;
    Chunk items = chunks[uint(first_chunk) + chunk];
    index = items.first + gl_LocalInvocationID.x;
    return gl_LocalInvocationID.x < items.count;
}
