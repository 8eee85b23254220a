// Ray marching of the ground by a maximum mipmap: each ray goes down through a pyramid of highest heights, to the first cell of the height map that
// it meets (Tevs, Ihrke & Seidel 2008, "Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field Rendering").
#include "ground/ground.glsl"
#include "layout/View"

layout(std430) readonly buffer Highest { float highest[]; };  // of 2 x 2, 4 x 4, ... cells, each by rows

uniform int starts[16];   // of each level in the table; there is none of level 0, whose cells are looked up
uniform int top_level;
uniform vec2 range_m;     // of depth
uniform vec2 relief_m;    // lowest and highest of all

const float NOWHERE = -1.0;

// Heights at a cell's corners: north-west, north-east, south-west, south-east
vec4 cornersOf(ivec2 c) {
    return vec4(texelFetch(ground_heights, c, 0).r, texelFetch(ground_heights, c + ivec2(1, 0), 0).r,
                texelFetch(ground_heights, c + ivec2(0, 1), 0).r, texelFetch(ground_heights, c + ivec2(1, 1), 0).r);
}

float bilinear(vec4 h, vec2 f) { return mix(mix(h.x, h.y, f.x), mix(h.z, h.w, f.x), f.y); }

// Along a line the gap above a bilinear patch is a quadratic, which its values at both ends and between them give.
// Where it first vanishes, 0 to 1.
float firstRoot(float g0, float middle, float g1) {
    if (g0 <= 0.0) return 0.0;
    float a = 2.0 * (g0 + g1 - 2.0 * middle), b = 4.0 * middle - 3.0 * g0 - g1, inner = b * b - 4.0 * a * g0;
    if (inner < 0.0) return NOWHERE;
    float below = -b + sqrt(inner), s = below > 0.0 ? 2.0 * g0 / below : NOWHERE;
    return s <= 1.0 ? s : NOWHERE;
}

// The depth, from one on, at which a ray meets the ground, or what is so far above it. With one exit: a return from a loop, or before
// one, costs CPU drivers more than the loop.
float march(vec3 eye, vec3 ray, float from, float above_m) {
    float t = from, found = NOWHERE;
    bool ends = false;
    if (eye.y < view.clip_below_m) {
        ends = ray.y <= 0.0;
        t = max(t, (view.clip_below_m - eye.y) / ray.y);
    }
    eye.y -= above_m;
    if (eye.y + ray.y * t > relief_m.y) {
        ends = ends || ray.y >= 0.0;
        t = (relief_m.y - eye.y) / ray.y;
    }
    if (relief_m.x == relief_m.y) return ends ? NOWHERE : t;
    vec2 last = ground.samples - 1.0, at0 = (eye.xz + ground.folded_anchor_m + 0.5 * ground.size_m) * ground.samples_per_m;
    vec2 along = ray.xz * ground.samples_per_m;
    float nudge = 1e-3 / max(max(abs(along.x), abs(along.y)), 1e-6);  // a thousandth of a cell
    int level = top_level;
    for (int i = 0; !ends && i < 4096 && t < range_m.y; i++) {
        // beyond its edge the ground goes on mirrored, or repeated
        vec2 at = at0 + along * t, copy = floor(at / last), inside = at - copy * last, direction = along;
        bvec2 turned = ground.beyond == REPEAT ? bvec2(false) : notEqual(mod(copy, 2.0), vec2(0.0));
        if (turned.x) { inside.x = last.x - inside.x; direction.x = -direction.x; }
        if (turned.y) { inside.y = last.y - inside.y; direction.y = -direction.y; }
        ivec2 cell = clamp(ivec2(inside), ivec2(0), ivec2(last) - 1) >> level;
        vec2 low = vec2(cell << level), high = min(vec2((cell + 1) << level), last);
        vec2 leaves = (mix(low, high, greaterThan(direction, vec2(0.0))) - inside) / direction;
        leaves = mix(leaves, vec2(1e9), equal(direction, vec2(0.0)));
        float span = max(min(leaves.x, leaves.y), 0.0);
        float y0 = eye.y + ray.y * t, y1 = y0 + ray.y * span, top;
        vec4 corners;
        if (level == 0) {
            corners = cornersOf(cell);
            top = max(max(corners.x, corners.y), max(corners.z, corners.w));
        } else {
            int columns = (int(last.x) + (1 << level) - 1) >> level;
            top = highest[starts[level] + cell.y * columns + cell.x];
        }
        if (min(y0, y1) > top) {
            t += span + nudge;
            level = min(level + 1, top_level);
        } else if (level > 0) {
            level--;
        } else {
            vec2 f0 = inside - low, f1 = f0 + direction * span;
            float root = firstRoot(y0 - bilinear(corners, f0), 0.5 * (y0 + y1) - bilinear(corners, 0.5 * (f0 + f1)),
                                   y1 - bilinear(corners, f1));
            ends = root >= 0.0;
            if (ends) found = t + root * span;
            t += span + nudge;
        }
    }
    return found;
}
