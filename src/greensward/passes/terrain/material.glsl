// Colour and normal of the ground where it is seen: soil, maps, and the sward where blades end.
#include "culling/level_of_detail.glsl"
#include "ground/soil.glsl"
#include "shaders/gbuffer.glsl"

uniform sampler2D soil;
uniform vec2 left_out;  // parts of the number and of the height of blades that the technique leaves out at the reach
#ifdef TILES
uniform sampler2DArray tile_soils;  // square roots of colours
#endif

vec3 soilTexel(int tile, vec2 uv, vec2 dx, vec2 dy) {
#ifdef TILES
    vec3 root = textureGrad(tile_soils, vec3(uv, float(max(tile, 0))), dx, dy).rgb;
    if (tile >= 0) return root * root;
#endif
    return textureGrad(soil, uv, dx, dy).rgb;
}

// Blended with their contrast kept (Heitz & Neyret 2018, equation 2)
vec3 untiled(int tile, vec2 xz, vec2 dx, vec2 dy) {
    Hexagons h = hexagonsAt(tile, xz);
    vec2 uv = soilUv(tile, xz);
    vec3 w = h.weight;
    vec3 ta = soilTexel(tile, uv + shiftOf(h.a), dx, dy);
    vec3 tb = soilTexel(tile, uv + shiftOf(h.b), dx, dy);
    vec3 tc = soilTexel(tile, uv + shiftOf(h.c), dx, dy);
    vec3 mean = tile < 0 ? ground.soil_mean.rgb : ground.tile_mean[max(tile, 0)].rgb;
    vec3 mixed = w.x * (ta - mean) + w.y * (tb - mean) + w.z * (tc - mean);
    return max(mean + mixed * inversesqrt(dot(w, w)), 0.0);
}

// Where a neighbouring pixel's ray meets the plane of the ground here: the footprint of a pixel
vec2 onPlane(ivec2 pixel, vec3 p, vec3 normal) {
    vec3 ray = rayThrough(pixel);
    float slant = dot(normal, ray);
    vec3 start = view.origin_ws.xyz + startOf(pixel);
    float along = dot(normal, p - start) / (abs(slant) > 1e-3 ? slant : -1e-3);
    return (start + ray * along).xz;
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    if (classAt(pixel) != CLASS_GROUND) return false;
    vec3 position_ws = worldAt(pixel);
    vec2 xz = position_ws.xz, world = inWorld(xz);
    float away = distance(position_ws, view.camera_ws.xyz);
    vec3 normal = groundNormal(xz);
    vec2 right = onPlane(pixel + ivec2(1, 0), position_ws, normal) - xz;
    vec2 up = onPlane(pixel + ivec2(0, 1), position_ws, normal) - xz;
    float footprint = length(up);
    Sward s = swardAt(xz, footprint);
    vec4 grass = swardColour(xz, s, footprint);
    float grown = s.density * slopeShare(normal.y) * smoothstep(0.0, 40.0, sward.density_per_m2);
    if (sward.count == 0) grown = 0.0;

    // Equation 1 of Jahrmann & Wimmer 2013: the terrain map over the tile's texture by its alpha
    vec4 map = textureGrad(terrain_map, mapUv(xz), right / ground.size_m, up / ground.size_m);
    int tile = tileAt(xz);
    float perM = soilPerM(tile);
    vec3 soilHere = untiled(tile, xz, right * perM, up * perM);
    // a picture shows as it is
    if (tile < 0 && ground.soil_drift > 0.0) soilHere *= 1.0 + ground.soil_drift * driftAt(world * 1.7, 5003u);
    vec3 bare = mix(soilHere, map.rgb, map.a);

    // The ground takes on what blades would have shown where they end, or are too few.
    float crowding = sward.density_per_m2 * sward.blade_m.x * s.density * slopeShare(normal.y) * s.height;
    float least = view.camera_pixel_m.x * away + view.camera_pixel_m.y;
    float layers = occludingLayers(crowding, dot(view.camera_ws.xyz - position_ws, normal) / away, least);
    float thinned = 1.0 - exp(-layers * max(wantedCoverage(layers, away) - greatestCoverage(away, least), 0.0));
    vec2 kept = 1.0 - left_out * min(away / sward.reach_m, 1.0);
    float missing = 1.0 - kept.x * kept.y;
    thinned = max(thinned, 1.0 - exp(-layers * missing * missing));
    if (sward.blades_m < sward.reach_m) thinned = max(thinned, farFade(away));
    float beyond = smoothstep(0.8, 1.0, away / sward.reach_m);
    // from afar turf ends in tufts: between turf and soil there is no half-way to light
    float edge = max(0.22 + 0.16 * simplex(world * 0.21, 911u) + 0.1 * simplex(world * 0.9, 913u), 0.07);
    float covered = mix(grown, smoothstep(edge - 0.06, edge + 0.06, grown), max(thinned, beyond));
    float turf = covered * clamp(max(0.25 + 0.75 * thinned, beyond), 0.0, 1.0) * sward.grown;
    // tufts, as far as a pixel resolves them
    float mottled = 1.0;
    for (float tufts = 0.13; tufts < 6.0; tufts *= 2.9) {
        float resolved = 1.0 - smoothstep(0.15, 0.6, tufts * footprint);
        if (resolved > 0.0) mottled += 0.16 * resolved * simplex(world * tufts, 77u + uint(tufts * 100.0));
    }

    // seen from afar the ground is a wall of blades, each turned to the viewer as much as up
    vec3 toViewer = normalize(view.eye_ws.xyz - position_ws * view.eye_ws.w);
    vec3 wall = normalize(0.8 * normalize(toViewer - normal * dot(toViewer, normal)) + 0.69 * normal);
    vec3 shading = normalize(mix(normal, wall, turf * turf * max(thinned, beyond)));
    // under a sward little light arrives; from afar the ground stands for its tips
    float open = mix(1.0, mix(0.3, 0.97, max(thinned * thinned, beyond)), grown * sward.grown);
    vec3 hue = 1.0 + 0.16 * driftAt(world * 0.31, 6007u) * vec3(1.0, 0.1, -0.6);
    result[0] = packColour(mix(bare, grass.rgb * mottled * hue, turf), sqrt(turf) * grass.w * 0.92);
    result[1] = packNormal(shading, open, 0.95);
    return true;
}
