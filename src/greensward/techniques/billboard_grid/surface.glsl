// The surface that a pixel shows of the grid.
#include "shaders/gbuffer.glsl"
#include "shaders/surface.glsl"
#include "layout/SurfaceBits"
#include "techniques/billboard_grid/trace.glsl"

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);  // of linear sRGB
const float TILT = 2.1;  // in radians, from those that lean to the viewer to those that lean away

layout(std430) writeonly buffer TracedIds { uvec2 traced_ids[]; };  // of each pixel that shows traced grass

bool surfaceAt(ivec2 pixel, out Surface s, out float depth_m) {
    float end_m = min(depthAt(pixel), range_m.y);
    Traced t;
    Around a;
    vec3 ray = rayThrough(pixel), start_rs = startOf(pixel);
    if (!trace(uvec2(pixel), start_rs, ray, end_m, classAt(pixel) == CLASS_GROUND, t, a)) return false;
    depth_m = t.depth_m;
    vec3 p_rs = start_rs + ray * depth_m, p_ws = view.origin_ws.xyz + p_rs, up = groundNormal(p_ws.xz);
    float away = distance(p_ws, view.camera_ws.xyz), far = smoothstep(8.0, 90.0, away), all = 1.0 / t.colour.a;
    float footprint = view.camera_pixel_m.x * away + view.camera_pixel_m.y;
    vec2 root = p_ws.xz - swayed(a.v1, a.v2, t.rest).xz;
    vec4 own = speciesColour(root, Sward(1.0, 1.0, a.dryness), 0.9), map = paintedAt(root, footprint);
    // the drifts of the sward, which the billboards do not know; as elsewhere, contrast fades with distance
    vec3 texel = t.colour.rgb * all, drifted = texel * clamp(own.rgb / max(mean_material.rgb, vec3(1e-3)), 0.2, 12.0);
    // what is painted replaces the colour, and leaves to the billboards how light and dark alternate
    drifted = mix(drifted, map.rgb * (dot(texel, LUMINANCE) / max(dot(mean_material.rgb, LUMINANCE), 1e-3)), map.a);
    vec3 sown = mix(own.rgb, map.rgb, map.a);
    // tufts, as far as a pixel resolves them: among several billboards those of each are lost
    float mottled = 1.0;
    for (float tufts = 0.9; tufts < 12.0; tufts *= 3.1) {
        float resolved = smoothstep(0.0, 6.0, away) * (1.0 - smoothstep(0.15, 0.6, tufts * footprint));
        if (resolved > 0.0) mottled += 0.22 * resolved * simplex(inWorld(p_ws.xz) * tufts, 177u + uint(tufts * 100.0));
    }
    vec3 toViewer = normalize(view.eye_ws.xyz - p_ws * view.eye_ws.w);
    vec3 back = normalize(toViewer - up * dot(toViewer, up)), wall = normalize(0.8 * back + 0.75 * up);
    // where a pixel is wider than blades they would be drawn a pixel wide, and each in its own direction
    vec3 random = unit(hash3(uvec3(t.blade, sward.seed))) - 0.5;
    drifted *= mix(vec3(1.0), shadeOf(random.x), t.coarse);
    float around = 3.14159 * random.y, tilt = TILT * random.z;
    vec3 turned = cos(tilt) * (cos(around) * back + sin(around) * cross(up, back)) + sin(tilt) * up;
    t.normal_ws = mix(normalize(t.normal_ws + 1e-4 * up), turned, t.coarse);
    s.baseColour = mottled * mix(drifted, sown, 0.7 * far);
    float along = clamp(t.along * all, 0.0, 1.0), high = clamp(t.high * all, 0.0, 1.0);
    s.transmittance = mean_material.w * mix(0.45, 1.0, along);
    s.roughness = mix(mean_blade.y, 0.95, far);
    s.occlusion = mix(mix(0.2, 0.8, far), 1.0, high * (2.0 - high));
    s.normal_ws = normalize(mix(t.normal_ws, wall, 0.8 * far));
    s.surfaceClass = CLASS_GRASS;
    uint index = uint(pixel.y * int(view.size_px.x) + pixel.x);
    traced_ids[index] = t.blade;
    s.bladeNumber = FIRST_TRACED | index & (FIRST_TRACED - 1u);
    vec3 moved = swayed(a.before1 - a.v1, a.before2 - a.v2, t.rest);
    s.previousClip = view.previous_clip_from_relative * vec4(p_rs + moved, 1.0);
    return true;
}
