// Rings of square cells around the camera, in patches of 8 by 8: those of the first are tiles with blades; each of the others
// reaches twice as far as the one within, with flat cells twice as large.
#include "ground/ground.glsl"
#include "layout/View"
#include "shaders/dispatch.glsl"
#include "techniques/geometry_billboards/tiles.glsl"

const int LEVELS = 4;      // three of blades, and that of flat tiles
const uint PATCH = 64u;    // cells, in two words of bits

uniform ivec4 ring_patches[RINGS];  // first patch of all, patches a side, first column and row in the world, in patches
uniform vec4 ring_reach[RINGS];     // edge of a cell, from where and to where the ring is needed
uniform ivec2 ring_here[RINGS];     // cell with the origin of relative space
uniform vec2 ring_corner_m[RINGS];  // its x and z there
uniform vec3 levels_m;
uniform float tallest_m;
uniform float widest_m;
uniform float min_width_px;
uniform int patches;

struct Cell {
    ivec2 at;        // in cells of its ring
    float edge_m;
    vec2 corner_m;   // in relative space
    float heights[4];
    uint number;
    int ring;
};

float heightAt(vec2 relative) { return groundHeight(relative + view.origin_ws.xz); }

bool cellOf(uint number, uint lane, out Cell c) {
    if (number >= uint(patches)) return false;
    c.ring = 0;
    for (int i = 1; i < RINGS; i++) if (int(number) >= ring_patches[i].x) c.ring = i;
    ivec4 place = ring_patches[c.ring];
    int index = int(number) - place.x;
    ivec2 within = 8 * ivec2(index % place.y, index / place.y) + ivec2(lane & 7u, lane >> 3u);
    c.edge_m = ring_reach[c.ring].x;
    c.at = 8 * place.zw + within;
    // counted from there, so that it does not depend on how far the ring reaches
    c.corner_m = ring_corner_m[c.ring] + vec2(c.at - ring_here[c.ring]) * c.edge_m;
    c.number = number * PATCH + lane;
    return true;
}

void measure(inout Cell c) {
    for (int i = 0; i < 4; i++) c.heights[i] = heightAt(c.corner_m + vec2(i >> 1, i & 1) * c.edge_m) - view.origin_ws.y;
}

// Whether a box lies outside one side of the view, of which samples see half a pixel more. Never true where a part is in view.
bool isOutside(vec3 centre, vec3 size) {
    mat4 m = transpose(view.clip_from_relative);
    vec2 edge = 1.0 + view.size_px.zw;
    for (int i = 0; i < 4; i++) {
        vec4 plane = m[3] * edge[i & 1] + (i < 2 ? m[i & 1] : -m[i & 1]);
        if (dot(plane.xyz, centre) + plane.w + dot(abs(plane.xyz), size) < 0.0) return true;
    }
    return false;
}

// How far a blade reaches out of the cells, whose middle is here: bent flat, with half of the width that it is drawn at
float marginAt(vec3 middle, vec3 size) {
    float pixel = view.pixel_m.x * (length(middle - view.eye_rs.xyz * view.eye_rs.w) + length(size)) + view.pixel_m.y;
    return tallest_m + 0.5 * max(widest_m / max(view.density, 1e-3), min_width_px * pixel);
}

bool isOutsideWithBlades(vec3 middle, vec3 size) { return isOutside(middle, size + marginAt(middle, size)); }

bool isOutside(Cell c, bool bare) {
    float low = min(min(c.heights[0], c.heights[1]), min(c.heights[2], c.heights[3]));
    float high = max(max(c.heights[0], c.heights[1]), max(c.heights[2], c.heights[3]));
    vec3 size = 0.5 * vec3(c.edge_m, high - low, c.edge_m), middle = vec3(c.corner_m.x, low, c.corner_m.y) + size;
    return bare ? isOutside(middle, 1.01 * size + 0.01) : isOutsideWithBlades(middle, size);
}

// Section 2.4: the levels that a cell is drawn at, a bit for each; 0, 1 and 2 are the source's LOD 3, 2 and 1, and 3 its LOD 0
uint levelsOf(Cell c) {
    vec3 middle = vec3(c.corner_m.x + 0.5 * c.edge_m, 0.25 * (c.heights[0] + c.heights[1] + c.heights[2] + c.heights[3]), c.corner_m.y + 0.5 * c.edge_m);
    float away = distance(middle + view.origin_ws.xyz, view.camera_ws.xyz), half_m = 0.75 * c.edge_m;
    vec3 reach = ring_reach[c.ring].xyz;
    if (ground.beyond == 1) {
        vec2 corner = inWorld(c.corner_m + view.origin_ws.xz);
        if (any(greaterThan(corner, 0.5 * ground.size_m)) || any(lessThan(corner + c.edge_m, -0.5 * ground.size_m))) return 0u;
    }
    if (c.ring > 0) return away + half_m > reach.y && away - half_m < reach.z ? 8u : 0u;
    if (away - half_m >= levels_m.z) return 0u;
    away = min(away, 0.9999 * levels_m.z);
    return away < levels_m.x ? 1u : away < levels_m.y ? 2u : 4u;
}
