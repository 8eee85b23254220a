// Clearings: the part of the ground that objects and `[[clear]]` leave to grass. Each shape is made of convex quadrilaterals
// with a radius and a soft edge around them, listed by the cells of a hash grid with several sizes of cells.
#include "ground/ground.glsl"

#ifdef CLEARINGS
uniform usampler2D clearings;  // as sowing/clearings.py packs them

uvec4 clearingTexel(uint index) { return texelFetch(clearings, ivec2(index & 1023u, index >> 10u), 0); }

float squaredDistanceToSide(vec2 p, vec2 a, vec2 b) {
    vec2 along = b - a, from = p - a;
    vec2 off = from - along * clamp(dot(from, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    return dot(off, off);
}

float crossed(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

// To a convex quadrilateral whose corners turn from x to z, and may coincide; 0 inside
float distanceToQuad(vec2 p, vec2 a, vec2 b, vec2 c, vec2 d) {
    vec4 side = vec4(crossed(b - a, p - a), crossed(c - b, p - b), crossed(d - c, p - c), crossed(a - d, p - d));
    if (all(greaterThanEqual(side, vec4(0.0))) && side.x + side.y + side.z + side.w > 0.0) return 0.0;
    vec2 nearer = min(vec2(squaredDistanceToSide(p, a, b), squaredDistanceToSide(p, b, c)),
                      vec2(squaredDistanceToSide(p, c, d), squaredDistanceToSide(p, d, a)));
    return sqrt(min(nearer.x, nearer.y));
}

// Over a footprint, of which a narrow shape takes only a part. Inside a quadrilateral, how far its border is is not known.
float openBeside(uint entry, vec2 p, float footprint_m) {
    vec4 ab = uintBitsToFloat(clearingTexel(entry + 1u)), cd = uintBitsToFloat(clearingTexel(entry + 2u));
    vec4 shape = uintBitsToFloat(clearingTexel(entry + 3u));  // radius, edge, width
    float past = distanceToQuad(p, ab.xy, ab.zw, cd.xy, cd.zw) - shape.x + min(0.5 * footprint_m, shape.x);
    float cleared = 1.0 - clamp(past / max(shape.y + footprint_m, 1e-4), 0.0, 1.0);
    return 1.0 - cleared * min(1.0, shape.z / max(footprint_m, 1e-4));
}
#endif

// Part of the blades that may grow at a place, as the mean over a footprint
float openAt(vec2 xz, float footprint_m) {
#ifdef CLEARINGS
    vec4 bounds = uintBitsToFloat(clearingTexel(0u));
    vec2 world = inWorld(xz);
    bool near = all(greaterThanEqual(world, bounds.xy)) && all(lessThanEqual(world, bounds.zw));
    float open = 1.0;
    uvec4 head = clearingTexel(1u);  // sizes of cells in use as bits, from a quarter of a metre; buckets less one
    for (uint sizes = near ? head.x : 0u; sizes != 0u && open > 0.0; sizes &= sizes - 1u) {
        int size = findLSB(sizes);
        float cell_m = 0.25 * exp2(float(size));
        vec2 local = floor(xz / cell_m);
        ivec2 cell = ivec2(local) + ivec2(ground.anchor_m / cell_m);
        uint hash = uint(cell.x) * 73856093u ^ uint(cell.y) * 19349663u ^ uint(size) * 83492791u;
        uvec4 bucket = clearingTexel(2u + ((hash ^ hash >> 15u) & head.y));  // first texel, entries
        for (uint i = 0u; i < bucket.y; i++) {
            uint entry = bucket.x + 4u * i;
            uvec4 lies = clearingTexel(entry);
            if (lies.xyz == uvec3(uvec2(cell), uint(size))) open = min(open, openBeside(entry, xz - local * cell_m, footprint_m));
        }
    }
    return open;
#else
    return 1.0;
#endif
}
