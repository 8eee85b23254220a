// Occlusion culling of a blade against the depth pyramid (Greene, Kass & Miller 1993). Points are in relative space.
#include "layout/View"
#include "culling/depth_pyramid.glsl"

// Pixels that it may touch, first and last of both axes; false where it comes too near for that
bool boxOf(vec3 v0, vec3 v1, vec3 v2, float width_m, out ivec4 box, out float nearest) {
    vec4 a = view.clip_from_relative * vec4(v0, 1.0);
    vec4 b = view.clip_from_relative * vec4(v1, 1.0);
    vec4 c = view.clip_from_relative * vec4(v2, 1.0);
    vec3 depth_m = vec3(dot(view.axis_rs.xyz, v0), dot(view.axis_rs.xyz, v1), dot(view.axis_rs.xyz, v2)) + view.axis_rs.w;
    nearest = min(min(depth_m.x, depth_m.y), depth_m.z) - width_m;
    if (nearest < 0.05) return false;
    vec2 pa = a.xy / a.w, pb = b.xy / b.w, pc = c.xy / c.w;
    vec2 low = min(min(pa, pb), pc), high = max(max(pa, pb), pc);
    // a point moved by r: its clip coordinates change by |row| r, and what they are divided by, by r or in a parallel view not at all
    mat4 m = transpose(view.clip_from_relative);
    vec2 margin = width_m * vec2(length(m[0].xyz), length(m[1].xyz));
    if (view.eye_rs.w > 0.0) margin = (margin + width_m * max(abs(low), abs(high))) / nearest;
    vec2 last = view.size_px.xy - 1.0;
    // a pixel more, as the samples of a picture are apart by less
    vec2 first_px = floor((0.5 + 0.5 * (low - margin)) * view.size_px.xy) - 1.0;
    vec2 last_px = floor((0.5 + 0.5 * (high + margin)) * view.size_px.xy) + 1.0;
    box = ivec4(clamp(first_px, vec2(0.0), last), clamp(last_px, vec2(0.0), last));
    return true;
}

// The level at which a box of pixels lies in 2 x 2 texels
int levelOf(ivec4 box) {
    int extent = max(box.z - box.x, box.w - box.y);
    return extent <= 2 ? 1 : findMSB(extent - 1) + 1;
}

float farthestDepthIn(ivec4 box) {
    int level = levelOf(box), start;
    ivec2 size;
    findLevel(level, ivec2(view.size_px.xy), start, size);
    ivec4 t = box >> level;
    float low = max(depth_pyramid[start + t.y * size.x + t.x], depth_pyramid[start + t.y * size.x + t.z]);
    float high = max(depth_pyramid[start + t.w * size.x + t.x], depth_pyramid[start + t.w * size.x + t.z]);
    return max(low, high);
}

// Whether it lies behind all that is drawn before it where it would show (Greene, Kass & Miller 1993). The pyramid is of the
// first sample, and a depth buffer of 24 bits is no finer than the tolerance.
bool hidden(vec3 v0, vec3 v1, vec3 v2, float width_m) {
    ivec4 box;
    float nearest;
    return boxOf(v0, v1, v2, width_m, box, nearest) && nearest > 1.002 * farthestDepthIn(box) + 0.01;
}
