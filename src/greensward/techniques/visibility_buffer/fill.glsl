// Scanline rasterisation of quads: every pixel whose centre lies inside, each row from its left to its right edge, both half-open, so that
// neighbours share no pixel and leave none between them.
#include "techniques/visibility_buffer/visibility.glsl"

#if !defined(WIDE) && !defined(SHADOW)
// With 32 bits a pixel is filled in two runs of the same code: how near, then, where it is as near as that, the id.
#define TWO_PASSES
uniform bool writing_ids;
#endif

bool writeNearest(uint pixel_index, float nearness, uint primitive_id) {
    uint key = keyOf(nearness);
#ifdef WIDE
    uint64_t value = packUint2x32(uvec2(primitive_id, key));
    if (value > visible[pixel_index]) atomicMax(visible[pixel_index], value);
    return true;
#else
    // most lose, and reading is cheaper than an atomic
    uint before = nearnesses[pixel_index];
    if (key < before) return false;
#ifdef SHADOW
    if (key > before) atomicMax(nearnesses[pixel_index], key);
    return true;
#else
    if (!writing_ids) {
        uint was = atomicMax(nearnesses[pixel_index], key);
        // an id of an earlier fill is of what lies behind this
        if (was < key) primitive_ids[pixel_index] = 0u;
        return was <= key;
    }
    if (key == before) atomicMax(primitive_ids[pixel_index], primitive_id);
    return true;
#endif
#endif
}

// x and y in pixels, whole numbers being their centres; nearness
vec3 onScreen(vec4 clip) { return vec3((0.5 + 0.5 * clip.xy / clip.w) * view.size_px.xy - 0.5, nearnessOf(clip)); }

// The nearness over the screen as a plane: its change along x and y. Diagonals, as an edge may have no length.
vec2 slopeOf(vec3 a0, vec3 a1, vec3 b0, vec3 b1) {
    vec3 d = b1 - a0, e = b0 - a1;
    float area = d.x * e.y - d.y * e.x;
    return abs(area) > 1e-6 ? vec2(d.z * e.y - e.z * d.y, e.z * d.x - d.z * e.x) / area : vec2(0.0);
}

void widen(inout vec2 span, float y, vec3 a, vec3 b) {
    if ((a.y <= y) == (b.y <= y)) return;
    // neighbours share edges, and must agree about them to the last bit
    if (a.y > b.y) { vec3 c = a; a = b; b = c; }
    float x = a.x + (y - a.y) * (b.x - a.x) / (b.y - a.y);
    span = vec2(min(span.x, x), max(span.y, x));
}

// The whole numbers in [low, high) that lie on the screen
ivec2 within(float low, float high, float size) {
    return ivec2(ceil(clamp(low, 0.0, size)), ceil(clamp(high, 0.0, size)));
}

// The quad with edges a0 a1 and b0 b1 across the blade. Whether some of it may show.
bool fillQuad(vec3 a0, vec3 a1, vec3 b0, vec3 b1, uint primitive_id) {
    bool shown = false;
    vec2 ends = vec2(min(min(a0.z, a1.z), min(b0.z, b1.z)), max(max(a0.z, a1.z), max(b0.z, b1.z)));
    ivec2 rows = within(min(min(a0.y, a1.y), min(b0.y, b1.y)), max(max(a0.y, a1.y), max(b0.y, b1.y)), view.size_px.y);
    vec2 slope = slopeOf(a0, a1, b0, b1);
    for (int row = rows.x; row < rows.y; row++) {
        float y = float(row);
        vec2 span = vec2(1e9, -1e9);
        widen(span, y, a0, a1);
        widen(span, y, b0, b1);
        widen(span, y, a0, b0);
        widen(span, y, a1, b1);
        ivec2 columns = within(span.x, span.y, view.size_px.x);
        uint pixel_index = pixelIndex(ivec2(0, row));
        for (int column = columns.x; column < columns.y; column++) {
            float nearness = a0.z + dot(slope, vec2(column, y) - a0.xy);
            shown = writeNearest(pixel_index + uint(column), clamp(nearness, ends.x, ends.y), primitive_id) || shown;
        }
    }
    return shown;
}
