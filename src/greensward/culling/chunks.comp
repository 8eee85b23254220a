// Cuts runs of items into chunks: each invocation finds the run that its chunk belongs to.
#include "layout/Run"
#include "layout/Chunk"

layout(local_size_x = 64) in;

layout(std430) readonly buffer Runs { Run runs[]; };  // in order of the first chunk
layout(std430) writeonly buffer Chunks { Chunk chunks[]; };

uniform int run_count;
uniform int chunk_count;

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (chunk >= uint(chunk_count)) return;
    int low = 0, high = run_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (runs[middle].first_chunk <= chunk) low = middle; else high = middle - 1;
    }
    Run run = runs[low];
    uint within = (chunk - run.first_chunk) * run.chunk_size;
    chunks[chunk] = Chunk(run.first + within, min(run.chunk_size, run.count - within));
}
