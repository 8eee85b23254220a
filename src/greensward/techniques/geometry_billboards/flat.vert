// A flat tile on the ground: a quad of the tile's two triangles (Derstroff 2024, section 2.4, LOD 0).
#include "sowing/sward.glsl"
#include "culling/level_of_detail.glsl"
#include "techniques/geometry_billboards/tiles.glsl"

in ivec2 tile;
in vec2 corner_m;
in float edge_m;
in uint number;
in vec4 first, second;

uniform float tile_m;  // edge of the tiles that bear blades

out vec2 uv;
out vec2 place_xz;  // counted from the anchor
out vec3 position_rs;
out vec3 up_ws;
out vec3 previousClip;
out vec4 material;  // colour, transmittance
out float cover;    // part of what a ray meets that is grass
flat out uint bladeNumber;

void main() {
    vec2 corner = vec2(gl_VertexID >> 1, gl_VertexID & 1);
    vec4 plane = gl_VertexID < 3 ? first : second;
    position_rs = vec3(corner_m.x, 0.0, corner_m.y) + vec3(corner.x, 0.0, corner.y) * edge_m;
    position_rs.y = heightOn(plane, corner * edge_m);
    vec3 at = position_rs + view.origin_ws.xyz, up = normalize(first.xyz + second.xyz), away = at - view.camera_ws.xyz;
    vec2 place = (vec2(tile) + corner) * edge_m - ground.anchor_m;
    // whole tiles left out, for precision far from the origin
    place_xz = place;
    uv = (vec2(tile & 1023) + corner) * (edge_m / tile_m);
    Sward s = swardByMaps(place, edge_m);  // clearings are finer
    float share = s.density * slopeShare(up.y);
    material = swardColour(place, s, edge_m);
    cover = 1.0 - exp(-occludingLayers(sward.density_per_m2 * sward.blade_m.x * share * s.height, -dot(away, up) / length(away), view.camera_pixel_m.x * length(away) + view.camera_pixel_m.y));
    up_ws = up;
    bladeNumber = number + 1u;
    gl_ClipDistance[0] = at.y - view.clip_below_m;
    gl_Position = view.jittered_clip_from_relative * vec4(position_rs, 1.0);
    previousClip = (view.previous_clip_from_relative * vec4(position_rs, 1.0)).xyw;
    if (view.low_detail != 0 && textureLod(density_map, mapUv(place), 0.0).g <= 0.0) cover = 0.0;
    // drawn before the ground that it lies on, and what the ground's curve hides of it: as near as its blades would be
    vec3 toEye = normalize(view.eye_rs.xyz - position_rs * view.eye_rs.w);
    vec4 nearer = view.jittered_clip_from_relative * vec4(position_rs + (sward.canopy_m + 0.25 * edge_m) * toEye, 1.0);
    if (nearer.w > 1e-3 && gl_Position.w > 1e-3) gl_Position.z = nearer.z / nearer.w * gl_Position.w;
}
