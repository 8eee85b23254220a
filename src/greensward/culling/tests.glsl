// Frustum culling of a blade. Like that of occlusion.glsl it is conservative: it looks at the hull of the control points, in
// which the curve lies, grown by the width. The published ones (Jahrmann & Wimmer 2017, section 5) look at root, middle and
// tip, and lose a blade that crosses the view between them.
// Points are in relative space.
#include "layout/View"

// Whether it lies outside one side of the view, of which samples see half a pixel more
bool outside(vec3 v0, vec3 v1, vec3 v2, float width_m) {
    vec4 a = view.clip_from_relative * vec4(v0, 1.0);
    vec4 b = view.clip_from_relative * vec4(v1, 1.0);
    vec4 c = view.clip_from_relative * vec4(v2, 1.0);
    mat4 m = transpose(view.clip_from_relative);
    vec2 edge = 1.0 + view.size_px.zw;
    vec2 margin = width_m * (vec2(length(m[0].xyz), length(m[1].xyz)) + edge);
    vec2 low = max(max(a.xy + edge * a.w, b.xy + edge * b.w), c.xy + edge * c.w);
    vec2 high = min(min(a.xy - edge * a.w, b.xy - edge * b.w), c.xy - edge * c.w);
    return any(lessThan(low, -margin)) || any(greaterThan(high, margin));
}
