// Heads of blades as a view shows them: how large, in which detail, and for how many others.
#include "culling/level_of_detail.glsl"
#include "shaders/bezier.glsl"

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) readonly buffer Poses { Pose poses[]; };
#ifdef FULL_HEIGHT
layout(std430) readonly buffer Sown { Blade sown[]; };
#endif

const int FAR = 2;               // the level without a mesh
const int FIRST_FLOWER = 3;      // panicle and spike are seed heads
const float APART_MOST_M = 0.5;

struct Head {
    Blade blade;
    bool flower;
    float fade;
    float size;   // metres
    float each;   // heads that it stands for
    vec3 root, v1, v2, tip;  // of its blade, in relative space; the tip as it is drawn
};

// Heads at this distance for each one that is there; as 1 / lodArea, but a head grows in evenly
float headsEach(float distance_m) {
#ifdef ALL_DISTANCES
    return 1.0 / view.density;
#else
    float coverage = lodCoverage(distance_m, view.density), last = clamp((coverage - view.density) / (GROWING * coverage), 0.0, 1.0);
    return 1.0 / (min((1.0 - GROWING) * coverage, view.density) + GROWING * coverage * (1.0 - last * last * last) / 3.0);
#endif
}

// Metres between heads of its species
float apart(int kindOfGrass) {
    return min(inversesqrt(sward.density_per_m2 * species(kindOfGrass, MIX).x * species(kindOfGrass, DRY).w), APART_MOST_M);
}

// From a blade to the member that is so many away, in distances between heads
float spread(float member) { return sqrt(member) * (0.5 + 0.07 * member); }

// False where distance leaves its blade out
bool findHead(uint index, out Head h) {
    h.blade = blades[index];
    float away = distance(bladeRoot(h.blade), view.camera_ws.xyz);
    h.fade = lodFade(h.blade, away);
#ifdef FULL_HEIGHT
    // the last of a blade to come
    h.fade *= smoothstep(0.6, 1.0, h.blade.height / max(sown[index].height * FULL_HEIGHT, 1e-6));
#endif
    h.each = headsEach(away);
    int kindOfGrass = bladeSpecies(h.blade);
    h.flower = int(species(kindOfGrass, MIX).w) >= FIRST_FLOWER;
    h.size = h.fade * mix(species(kindOfGrass, HEAD).w, species(kindOfGrass, HEART).w, fract(bladeRandom(h.blade) * 57.31));
    h.root = bladeRoot(h.blade) - view.origin_ws.xyz;
    unpackPose(poses[index].now, h.root, h.v1, h.v2);
    h.tip = mix(h.root, h.v2, h.fade);
    return h.fade > 0.0;
}

// Across and along its axis: where it stands for more than are drawn, a seed head grows more in width than in length.
// As less of a larger head is hidden, that is less than what they stand for; fitted with scripts/measure_detail.py.
vec2 grownSize(Head h, float heads_each) {
    float larger = pow(max(h.each / heads_each, 1.0), 0.87);
    return h.size * (h.flower ? vec2(sqrt(larger)) : vec2(pow(larger, 0.75), pow(larger, 0.25)));
}
