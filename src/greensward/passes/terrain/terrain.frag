#ifdef SHADOW
void main() {}
#else
#include "sowing/sward.glsl"
#include "shaders/surface.glsl"

layout(binding = 1) uniform sampler2D soil;
layout(binding = 2) uniform sampler2D terrainMap;

in vec3 position_ws;

// A texture without visible tiling: three copies, shifted at random per hexagon and blended with their contrast kept
// (Heitz & Neyret 2018, "High-Performance By-Example Noise", equation 2; hexagons after Mikkelsen 2022).
vec3 untiled(vec2 uv) {
    const mat2 skew = mat2(1.0, 0.0, -0.57735027, 1.15470054);
    vec2 s = skew * uv * 1.7;
    ivec2 base = ivec2(floor(s));
    vec3 t = vec3(fract(s), 0.0);
    t.z = 1.0 - t.x - t.y;
    vec3 w = t.z > 0.0 ? vec3(t.z, t.y, t.x) : vec3(-t.z, 1.0 - t.y, 1.0 - t.x);
    ivec2 a = t.z > 0.0 ? base : base + ivec2(1, 1);
    ivec2 b = t.z > 0.0 ? base + ivec2(0, 1) : base + ivec2(1, 0);
    ivec2 c = t.z > 0.0 ? base + ivec2(1, 0) : base + ivec2(0, 1);
    vec2 dx = dFdx(uv), dy = dFdy(uv);
    vec3 ta = textureGrad(soil, uv + unit(hash3(uvec3(uvec2(a), 1u))).xy, dx, dy).rgb;
    vec3 tb = textureGrad(soil, uv + unit(hash3(uvec3(uvec2(b), 1u))).xy, dx, dy).rgb;
    vec3 tc = textureGrad(soil, uv + unit(hash3(uvec3(uvec2(c), 1u))).xy, dx, dy).rgb;
    vec3 mean = ground.soil_mean.rgb;
    vec3 mixed = w.x * (ta - mean) + w.y * (tb - mean) + w.z * (tc - mean);
    return max(mean + mixed * inversesqrt(dot(w, w)), 0.0);
}

void main() {
    vec2 xz = position_ws.xz;
    float away = distance(position_ws, view.camera_ws.xyz);
    vec3 normal = groundNormal(xz);
    Sward s = swardAt(xz);
    vec4 grass = swardColour(xz, s);
    float grown = s.density * slopeShare(normal.y) * smoothstep(0.0, 40.0, sward.density_per_m2);
    if (sward.count == 0) grown = 0.0;

    // Equation 1 of Jahrmann & Wimmer 2013: the terrain map over the tile's texture by its alpha
    vec4 map = texture(terrainMap, mapUv(xz));
    vec3 bare = mix(untiled(xz * ground.soil_per_m), map.rgb, map.a);
    bare *= 1.0 + 0.25 * driftAt(xz * 1.7, 5003u);

    // Blades thin out with distance; the ground takes on what they would have shown.
    float thinned = 1.0 - keptShare(away);
    float beyond = smoothstep(0.8, 1.0, away / sward.reach_m);
    float turf = grown * clamp(max(0.25 + 0.75 * thinned, beyond), 0.0, 1.0);
    float mottled = 1.0 + 0.16 * simplex(xz * 0.9, 77u) * (1.0 - smoothstep(5.0, 60.0, away)) + 0.1 * simplex(xz * 0.07, 78u);

    Surface o;
    o.baseColour = mix(bare, grass.rgb * mottled, turf);
    o.transmittance = turf * grass.w * 0.85;
    // seen from afar the ground is a wall of blades, each turned to the viewer as much as up
    vec3 toViewer = normalize(view.eye_ws.xyz - position_ws * view.eye_ws.w);
    vec3 wall = normalize(0.8 * normalize(toViewer - normal * dot(toViewer, normal)) + 0.75 * normal);
    o.normal_ws = normalize(mix(normal, wall, turf * max(thinned, beyond)));
    // under a sward little light arrives; from afar the ground stands for its tips
    o.occlusion = mix(1.0, mix(0.3, 0.85, max(thinned * thinned, beyond)), grown);
    o.roughness = 0.95;
    o.surfaceClass = CLASS_GROUND;
    o.bladeId = 0u;
    o.clip = view.clip_from_world * vec4(position_ws, 1.0);
    o.previousClip = view.previous_clip_from_world * vec4(position_ws, 1.0);
    emitSurface(o);
}
#endif
