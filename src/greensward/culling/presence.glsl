// How much of a blade is there: blades thin out with distance, and each grows in rather than pops in.
#include "shaders/blade.glsl"
#include "sowing/sward.glsl"
#include "block/View"

const float GROWING = 0.2;  // of those kept

// Blades kept at this distance, as a part of all; goes on rising above 1 towards the camera, or the last ones would never be
// full-grown there
float risenAt(float distance_m, float density) {
    float ratio = sward.full_density_m / max(distance_m, 1e-3);
    return ratio * ratio * density;
}

// Integral of h * min(1, 2 h), the area of a blade that is there by h, which is as much shorter and at first narrower
float grownArea(float here) { return here < 0.5 ? here * here * here / 1.5 : 0.5 * here * here - 1.0 / 24.0; }

// Area of the blades that are there at this distance, as a part of that of all of them: the integral over their ranks
float areaThere(float distance_m, float density) {
#ifdef ALL_DISTANCES
    return density;
#else
    float risen = risenAt(distance_m, density), last = clamp((risen - density) / (GROWING * risen), 0.0, 1.0);
    return min((1.0 - GROWING) * risen, density) + GROWING * risen * (grownArea(1.0) - grownArea(last));
#endif
}

// 1 where the blade is fully there, less while it grows in, 0 where it is left out.
float presence(Blade b, float distance_m) {
    float rank = bladeRank(b);
#ifdef ALL_DISTANCES
    return rank > view.density || view.density <= 0.0 || distance_m >= sward.reach_m ? 0.0 : 1.0;
#else
    float risen = risenAt(distance_m, view.density);
    if (rank > view.density || risen <= 0.0) return 0.0;
    float edge = 1.0 - smoothstep(0.82, 1.0, distance_m / sward.reach_m);
    return edge * clamp((risen - rank) / (GROWING * risen), 0.0, 1.0);
#endif
}
