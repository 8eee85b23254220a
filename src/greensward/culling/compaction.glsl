// Stream compaction: which blades of a chunk survived culling, and the index of each among all that did, in order.
#include "culling/chunk_items.glsl"
#include "culling/survivors.glsl"

uint compactedIndex(uint chunk, uint lane) { return compactedIndex(chunk, lane, uint(chunk_count)); }
