// From the id of a quad to the surface that it shows at a pixel.
#include "culling/blade_bounds.glsl"
#include "techniques/blades/blade_material.glsl"
#include "techniques/blades/normal.glsl"
#include "techniques/visibility_buffer/strip.glsl"
#include "techniques/visibility_buffer/visibility.glsl"

uniform uint first_primitive_id;
uniform uint blade_count;
uniform bool on_ground;         // where the vegetation map lies
uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space

// How far along and across its quad a pixel lies: centre + along * step + across * side is proportional to (ndc, 1) in
// x, y and w, which is linear in both unknowns.
vec2 placeIn(vec4 centre, vec4 step_, vec4 side, vec2 ndc) {
    vec2 a = step_.xy - ndc * step_.w, b = side.xy - ndc * side.w, c = ndc * centre.w - centre.xy;
    float area = a.x * b.y - a.y * b.x;
    return abs(area) > 1e-20 ? vec2(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x) / area : vec2(0.5, 0.0);
}

// False where no blade of this page shows
bool surfaceAt(ivec2 pixel, out Surface surface, out float depth_m) {
    float nearness;
    uint primitive_id = readVisible(pixelIndex(pixel), nearness), index = (primitive_id - first_primitive_id) >> 5u;
    if (primitive_id < first_primitive_id || index >= blade_count) return false;
    Blade b;
    BladeBounds h;
    if (!boundsOf(index, b, h)) return false;
    float wide = leafWidth(b, h);
    Strip s = stripOf(b, h, wide);
    float v0 = float(primitive_id & 31u) / float(s.segments), v1 = float((primitive_id & 31u) + 1u) / float(s.segments);
    vec4 centre = centreAt(s, v0), step_ = centreAt(s, v1) - centre;
    vec2 ndc = (vec2(pixel) + 0.5) * view.size_px.zw * 2.0 - 1.0;
    vec2 place = placeIn(centre, step_, s.side, ndc);
    float along = clamp(place.x, 0.0, 1.0), v = mix(v0, v1, along);
    vec2 edges = mix(edgesAt(s, v0, centre.w), edgesAt(s, v1, centre.w + step_.w), along);
    float across = clamp(place.y, edges.x, edges.y), u = (across - edges.x) / max(edges.y - edges.x, 1e-4);
    // a pixel as wide as the blade sees its mean normal
    u = mix(0.5, u, clamp(0.5 * wide * (edges.y - edges.x) / h.pixel - 0.5, 0.0, 1.0));

    vec3 tangent = bezierTangent(h.v0, h.v1, h.v2, v);
    vec3 offset = wide * across * s.side_ws;
#ifdef FOLD
    if (isFolded(s)) offset += wide * shapeFold(s.shape, u, v) * cross(s.side_ws, normalize(tangent));
#endif
    vec3 position_rs = mix(bezierPoint(h.v0, h.v1, h.v2, v0), bezierPoint(h.v0, h.v1, h.v2, v1), along) + offset;
    vec3 control, tip;
    poseBefore(index, b, h.v0, control, tip);
    control = mix(h.v0, control, h.fade);
    tip = mix(h.v0, tip, h.fade);
    vec3 before = mix(bezierPoint(h.v0, control, tip, v0), bezierPoint(h.v0, control, tip, v1), along) + offset;

    vec3 toEye = view.eye_rs.xyz - position_rs * view.eye_rs.w;
    Material material = materialOf(b, h, on_ground);
    surface = leafSurface(material, v);
    tangent = bezierTangent(h.v0, h.v1, h.v2, higher(v, material.share, TURNED));
    surface.normal_ws = leafNormal(acrossOf(b, chordOf(h)), s.side_ws, normalize(tangent), toEye, u, material.wall, material.far);
    surface.bladeNumber = primitive_id >> 5u;
    surface.previousClip = view.previous_clip_from_relative * (previous_from_now * vec4(before, 1.0));
    depth_m = depthOfNearness(nearness);
    return true;
}
