// Tiles of the ground and the roots in each of them (Derstroff 2024, "Real-time grass rendering").
#include "shaders/hash.glsl"

// Section 1.1: the planes Ax + By + Cz + D = 0 of the two triangles that a tile consists of, from its corners v1 and, along z,
// v2, along x, v3, and beyond both, v4.
void planesOf(vec3 v1, vec3 v2, vec3 v3, vec3 v4, out vec4 first, out vec4 second) {
    vec3 n1 = cross(normalize(v2 - v1), normalize(v3 - v1)), n2 = cross(normalize(v3 - v4), normalize(v2 - v4));
    first = vec4(n1, -dot(n1, v1));
    second = vec4(n2, -dot(n2, v4));
}

// Section 2: the triangle that a place lies on, in edges of the tile
bool isOnFirst(vec2 place) { return place.x + place.y <= 1.0; }

float heightOn(vec4 plane, vec2 xz) { return -(plane.x * xz.x + plane.z * xz.y + plane.w) / plane.y; }

// Section 2.5: the pattern of each tile, shifted by the tile's random value
vec2 shifted(vec2 place, float r) { return mod(place + vec2(r), 1.0); }

// Section 2.5: r = f(tile.pos, grass.pos). The source has one value for both uses; here the shift is one for the tile, or the
// pattern would be lost, and the colour one for the root, whose position in the pattern its number stands for.
float randomOfTile(ivec2 tile, uint seed) { return unit(hash3(uvec3(uvec2(tile), seed ^ 0x7f4a7c15u)).x); }
uvec3 randomOfRoot(ivec2 tile, uint root, uint seed) { return hash3(uvec3(uvec2(tile), root + seed * 0x9e3779b9u)); }

// Section 2.5: textureID = (r < alpha) ? 1 : (r < beta) ? 2 : 3, counted from 0
int textureOf(float r, float alpha, float beta) { return r < alpha ? 0 : r < beta ? 1 : 2; }
