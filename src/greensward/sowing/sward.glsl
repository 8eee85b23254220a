// The sward as a function of place: how dense, how tall, how dry, of which species and of what mean colour.
// Sowing draws blades from it; the ground takes its colour where blades end.
#include "shaders/noise.glsl"
#include "ground/ground.glsl"
#include "sowing/colour.glsl"
#include "sowing/clearings.glsl"
#include "layout/Sward"
#include "layout/SpeciesRow"

uniform sampler2D density_map;

vec4 species(int index, int row) { return sward.species[index * SPECIES_ROWS + row]; }

struct Sward {
    float density;  // 0 to 1
    float height;   // factor
    float dryness;  // 0 to 1, where in its species' range
};

// Drifts are functions of the place in the world, not of that counted from the anchor
float driftAt(vec2 xz, uint salt) { return octaves(xz / sward.drift_m, sward.seed + salt, 3, 0.6, 2.7); }

// On a surface with any normal: the drifts of the three planes, blended, so that none streaks.
float driftOn(vec3 at, vec3 facing, uint salt) {
    if (facing.y == 1.0) return driftAt(at.xz, salt);
    vec3 weight = facing * facing;
    weight *= weight;
    weight /= weight.x + weight.y + weight.z;
    float sum = 0.0;
    if (weight.x > 0.01) sum += weight.x * driftAt(at.zy, salt);
    if (weight.y > 0.01) sum += weight.y * driftAt(at.xz, salt);
    if (weight.z > 0.01) sum += weight.z * driftAt(at.xy, salt);
    return sum;
}

// Without maps
Sward swardOn(vec3 at, vec3 facing) {
    float dense = driftOn(at, facing, 7u), tall = driftOn(at, facing, 1013u), dry = driftOn(at * 0.6, facing, 2027u);
    Sward s;
    s.density = clamp(1.0 - sward.drift * (0.25 - 0.6 * dense), 0.0, 1.0);
    s.height = 1.0 + 0.45 * sward.drift * tall;
    s.dryness = clamp(0.5 + 0.9 * sward.drift * (dry + 0.3 * dense), 0.0, 1.0);
    return s;
}

// With maps, but without clearings
Sward swardByMaps(vec2 xz, float footprint_m) {
    vec4 map = textureLod(density_map, mapUv(xz), 0.0);
    vec2 world = inWorld(xz);
    Sward s = swardOn(vec3(world.x, 0.0, world.y), vec3(0.0, 1.0, 0.0));
    s.density *= map.r * greenAt(xz, footprint_m);
    s.height *= map.b;
    bool outside = any(greaterThan(abs(world), 0.5 * ground.size_m));
    if (ground.beyond == 1 && outside) s.density = 0.0;
    return s;
}

// The mean over a footprint, or what is right at a root
Sward swardAt(vec2 xz, float footprint_m) {
    Sward s = swardByMaps(xz, footprint_m);
    s.density *= openAt(xz, footprint_m);
    return s;
}

Sward swardAt(vec2 xz) { return swardAt(xz, 0.0); }

// Fewer blades grow towards the steepest slope that bears any
float slopeShare(float normalY) { return clamp((normalY - sward.min_normal_y) / 0.04, 0.0, 1.0); }

float speciesWeight(int index, vec3 at, vec3 facing) {
    vec4 row = species(index, MIX);
    return row.x * exp(5.0 * row.y * driftOn(at, facing, 4001u + 331u * uint(index)));
}

// Cover-weighted mean colour of the blades of the species that grow here, where they have so much of their tips' colour;
// their transmittance in w
vec4 speciesColour(vec2 xz, Sward s, float tips) {
    vec4 sum = vec4(0.0);
    float total = 1e-6;
    vec3 world = vec3(inWorld(xz), 0.0).xzy;
    for (int i = 0; i < sward.count; i++) {
        vec4 size = species(i, SIZE), root = species(i, ROOT);
        float cover = speciesWeight(i, world, vec3(0.0, 1.0, 0.0)) * (size.x + size.y) * (size.z + size.w);
        float dry = mix(species(i, HABIT).z, species(i, HABIT).w, s.dryness);
        vec3 green = mix(root.rgb, species(i, TIP).rgb, tips);
        green = mix(green, species(i, HEAD).rgb, 0.5 * species(i, DRY).w);
        sum += cover * vec4(mix(green, species(i, DRY).rgb, dry), root.w);
        total += cover;
    }
    return sum / total;
}

// What shows of a sward from afar, over a footprint: next to nothing but tips
vec4 swardColour(vec2 xz, Sward s, float footprint_m) {
    vec4 own = speciesColour(xz, s, 0.98), map = paintedAt(xz, footprint_m);
    return vec4(mix(own.rgb, map.rgb, map.a), own.w);
}

// Coverage of the sown blades at this distance; wider ones make up for the rest.
float sownCoverage(float distance_m) {
    float ratio = sward.full_density_m / max(distance_m, 1e-3);
    return min(1.0, ratio * ratio);
}
