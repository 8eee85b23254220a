// Integer hashing: equal bits on every driver, and in NumPy.

// pcg3d of Jarzynski & Olano 2020, "Hash Functions for GPU Rendering", listing 2
uvec3 hash3(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    return v;
}

// 24 bits, so that the result is exact and below 1
float unit(uint h) { return float(h >> 8u) * (1.0 / 16777216.0); }
vec3 unit(uvec3 h) { return vec3(h >> 8u) * (1.0 / 16777216.0); }
