// Level of detail: blades thin out with distance, and each fades in rather than pops in.
#include "shaders/blade.glsl"
#include "sowing/sward.glsl"
#include "layout/View"

const float GROWING = 0.2;   // of those that are there
const float CLOSED = 6.0;    // blades that a ray passes where next to none gets through: one in 400
const float BROADEST = 0.12;  // of its length, as wide as a blade may become for others, or else
const float BROADEST_PX = 3.0;

// Coverage at this distance: blades that are there, as a part of all. It goes on rising above 1 towards the camera, or the last ones would never be
// full-grown there
float lodCoverage(float distance_m, float density) {
    float ratio = sward.full_density_m / max(distance_m, 1e-3);
    return ratio * ratio * density;
}

// Integral of h * min(1, 2 h), the area of a blade that is there by h, which is as much shorter and at first narrower
float fadedArea(float fade) { return fade < 0.5 ? fade * fade * fade / 1.5 : 0.5 * fade * fade - 1.0 / 24.0; }

// Area of the blades that are there at this distance, as a part of that of all of them: the integral over their ranks
float lodArea(float distance_m, float density) {
#ifdef ALL_DISTANCES
    return density;
#else
    float coverage = lodCoverage(distance_m, density), last = clamp((coverage - density) / (GROWING * coverage), 0.0, 1.0);
    return min((1.0 - GROWING) * coverage, density) + GROWING * coverage * (fadedArea(1.0) - fadedArea(last));
#endif
}

// How many blades a ray from the camera would pass if all were there. `crowding` is in metres of blade on a square metre,
// `slant` the sine of the angle at which the camera looks down on it, `least_m` the width that all have at least.
float occludingLayers(float crowding, float slant, float least_m) {
    slant = clamp(slant, 1e-3, 1.0);
    // of length times width an outline fills two thirds, and three quarters of that are turned to the viewer; as blades
    // lean, something shows from above
    float across = 0.5 * max(sward.blade_m.y, least_m) * length(vec2(0.9 * sqrt(1.0 - slant * slant), 0.4 * slant));
    return max(crowding * sward.grown * across / slant, 1e-6);
}

// Area to be drawn, as a part of that of all blades. Blades that lie at random hide all but exp(-layers) of what is behind
// them, however large each is (the Boolean model: Chiu, Stoyan, Kendall & Mecke 2013, "Stochastic Geometry and its
// Applications", section 3.1). So cover stays where area does, and those kept are as much wider as there are fewer; but where
// a ray would pass many more than close the sward, only as wide as closes it.
float wantedCoverage(float layers, float distance_m) {
    return clamp(CLOSED / layers, min(lodArea(distance_m, 1.0), 1.0), 1.0);
}

// Where too few are kept for that, they would be broader than grass is; the ground shows what is then left out.
float greatestCoverage(float distance_m, float least_m) {
    float broadest = max(BROADEST * sward.blade_m.x, BROADEST_PX * least_m) / max(max(sward.blade_m.y, least_m), 1e-6);
    return lodArea(distance_m, 1.0) * max(broadest, 1.0);
}

const float ENDING = 0.82;  // of the distance at which there are no blades any more, where they begin to end

float farFade(float distance_m) { return smoothstep(ENDING, 1.0, distance_m / sward.blades_m); }

// 1 where the blade is fully there, less while it grows in, 0 where it is left out.
float lodFade(Blade b, float distance_m) {
    float rank = bladeRank(b);
    if (b.y < view.clip_below_m || (view.low_detail != 0 && !isLowDetail(b))) return 0.0;
#ifdef ALL_DISTANCES
    return rank > view.density || view.density <= 0.0 || distance_m >= sward.blades_m ? 0.0 : 1.0;
#else
    float coverage = lodCoverage(distance_m, view.density);
    if (rank > view.density || coverage <= 0.0) return 0.0;
    float edge = 1.0 - farFade(distance_m);
    return edge * clamp((coverage - rank) / (GROWING * coverage), 0.0, 1.0);
#endif
}

// The up of what it grows on. On the ground a blade's own is turned from the vertical towards that, by a part of the way.
vec3 groundUnder(Blade b) {
    vec3 up = bladeUp(b);
    return isOnObject(b) ? up : normalize(vec3(sward.towards_normal, 1.0, sward.towards_normal) * up);
}
