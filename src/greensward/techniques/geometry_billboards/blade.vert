// A root of the pattern on one of the tiles: where it stands, which blade grows there, and what bends it.
#include "sowing/ground_blade.glsl"
#include "culling/level_of_detail.glsl"
#include "motion/pose.glsl"
#include "techniques/blades/material.glsl"
#include "techniques/geometry_billboards/tiles.glsl"
#include "techniques/geometry_billboards/rooted.glsl"
#ifdef GROWTH
#include "sowing/growth.glsl"
#endif

in vec2 place;        // in the pattern, in edges of a tile
in ivec2 tile;
in vec2 corner_m;     // of the tile, x and z in relative space
in float edge_m;
in uint number;
in vec4 first, second;  // planes of its triangles, from the corner

uniform uint roots;
uniform ivec2 anchor_tile;  // in which the anchor lies, and where in it
uniform vec2 in_tile;
uniform float time_s;
uniform float previous_time_s;
uniform vec2 thresholds;  // alpha and beta
uniform vec2 fade_m;      // where blades begin to shrink, and where nothing is left of them
uniform float lean;
uniform float min_width_px;

out Rooted rooted;

// The blade that the scene sows at a root: by the maps and drifts there, on the plane of its triangle
bool growAt(vec2 p, vec4 plane, float height_m, out Blade b) {
    Seed seed;
    uint index = uint(gl_VertexID);
    seed.random = randomOfRoot(tile, index, sward.seed);
    vec2 xz = (vec2(tile - anchor_tile) + p - in_tile) * edge_m;
    seed.root = vec3(xz.x, height_m, xz.y);
    seed.clump = clumpAt(xz).random;
    seed.rank = (float(index) + 0.5) / float(roots);
    if (!sproutOn(normalize(plane.xyz), seed, b)) return false;
#ifdef GROWTH
    grow(b);
#endif
    return !(b.y < view.clip_below_m || (view.low_detail != 0 && !isLowDetail(b)));
}

// How far winds, forces and its own lean move the tip aside: at most as far as it is tall
vec2 forceAtTime(Blade b, float time_s) {
    vec3 control, tip;
    bentControlPoints(b, time_s, control, tip);
    vec2 f = tip.xz - (1.0 - lean) * (bladeTip(b) - bladeRoot(b)).xz;
    return f * min(1.0, 0.97 * b.height / max(length(f), 1e-6));
}

// 1 near, 0 where flat tiles, or nothing, take the blade's place
float heightLeft(float away) {
#ifdef ALL_DISTANCES
    return away < sward.blades_m ? 1.0 : 0.0;
#else
    return (1.0 - farFade(away)) * (1.0 - clamp((away - fade_m.x) / max(fade_m.y - fade_m.x, 1e-3), 0.0, 1.0));
#endif
}

float widthAt(Blade b, float pixel, float left) {
    // those that stand for others are as much wider, and a little less, as wide ones lose less to the filter of shadow maps
    float least = min_width_px * pixel, natural = b.width * pow(max(view.density, 1e-3), -0.93);
#ifdef SHADOW
    // a texel wide at least, but then fewer, or the shade of thin blades would grow
    if (bladeRandom(b) * least > natural) return 0.0;
#endif
    return max(natural, least) * min(1.0, 2.0 * left);
}

#ifndef SHADOW
void colour(Blade b, float away) {
    int kind = bladeSpecies(b);
    vec3 shade = shadeOf(bladeTint(b) - 0.5), dry = species(kind, DRY).rgb, up = bladeUp(b);
    vec3 root = shade * mix(species(kind, ROOT).rgb, dry * 0.55, smoothstep(0.35, 1.0, bladeDryness(b)));
    vec3 tip = shade * mix(species(kind, TIP).rgb, dry, bladeDryness(b));
    dry *= shade;
    vec4 map = paintedAt(bladeRoot(b).xz, 0.0);
    root = mix(root, shade * map.rgb * 0.6, map.a);
    tip = mix(tip, shade * map.rgb, map.a);
    dry = mix(dry, shade * map.rgb, map.a);
    // contrast fades towards what the flat tiles show
    float far = smoothstep(8.0, 90.0, away);
    root = mix(root, 0.9 * tip, 0.85 * far);
    vec3 toViewer = view.camera_ws.xyz - bladeRoot(b);
    vec3 wall = normalize(0.8 * normalize(toViewer - up * dot(toViewer, up)) + 0.75 * up);
    rooted.material = uvec4(packUnorm4x8(vec4(sqrt(root), species(kind, ROOT).w)), packUnorm4x8(vec4(sqrt(tip), mix(species(kind, TIP).w, 0.95, far))),
                            packUnorm2x16(vec2(b.height / max(4.0 * sward.canopy_m, 1e-3), far)), packSnorm2x16(octahedralEncode(wall)));
    rooted.dry = packUnorm4x8(vec4(sqrt(dry), 0.0));
}
#endif

void main() {
    gl_Position = vec4(0.0);
    rooted.shape = vec4(0.0);
    vec2 p = shifted(place, randomOfTile(tile, sward.seed));
    vec4 plane = isOnFirst(p) ? first : second;
    rooted.root = vec3(corner_m.x, 0.0, corner_m.y) + vec3(p.x, 0.0, p.y) * edge_m;
    rooted.root.y = heightOn(plane, p * edge_m);
    float away = distance(rooted.root + view.origin_ws.xyz, view.camera_ws.xyz), left = heightLeft(away);
    Blade b;
    if (left <= 0.0 || !growAt(p, plane, rooted.root.y + view.origin_ws.y, b)) return;
    float depth = dot(view.axis_rs.xyz, rooted.root) + view.axis_rs.w, pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
    float width = widthAt(b, pixel, left);
    if (width <= 0.0) return;
    rooted.force.xy = left * forceAtTime(b, time_s);
#ifndef SHADOW
    vec3 front;
    bladeFrame(bladeUp(b), b.facing, front, rooted.side);
    rooted.force.zw = previous_time_s == time_s ? rooted.force.xy : left * forceAtTime(b, previous_time_s);
    colour(b, away);
#endif
    rooted.shape = vec4(left * b.height, width, 0.0, 0.0);
    float r = unit(hash3(randomOfRoot(tile, uint(gl_VertexID), sward.seed ^ 0x3c6ef372u)).y);
    rooted.numberAndTexture = uvec2(number + uint(gl_VertexID) + 1u, textureOf(r, thresholds.x, thresholds.y));
}
