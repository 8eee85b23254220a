// Cuts runs of items into chunks: each invocation finds the run that its chunk belongs to.
layout(local_size_x = 64) in;

// first chunk, first item, items, items per chunk; in order of the first chunk
layout(std430, binding = 0) readonly buffer Runs { uvec4 runs[]; };
layout(std430, binding = 1) writeonly buffer Table { uvec2 table[]; };

uniform int runCount;
uniform int chunkCount;

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (chunk >= uint(chunkCount)) return;
    int low = 0, high = runCount - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (runs[middle].x <= chunk) low = middle; else high = middle - 1;
    }
    uvec4 run = runs[low];
    uint within = (chunk - run.x) * run.w;
    table[chunk] = uvec2(run.y + within, min(run.w, run.z - within));
}
