// How much of a blade is there: blades thin out with distance, and each grows in rather than pops in.
#include "shaders/blade.glsl"
#include "sowing/sward.glsl"
#include "block/View"

// 1 where the blade is fully there, less while it grows in, 0 where it is left out.
// `widening` is what the blades that stay make up for those left out.
float presence(Blade b, float distance_m, out float widening) {
    float rank = bladeRank(b);
#ifdef ALL_DISTANCES
    widening = inversesqrt(max(view.density, 1e-6));
    return rank > view.density || view.density <= 0.0 || distance_m >= sward.reach_m ? 0.0 : 1.0;
#else
    float kept = keptShare(distance_m) * view.density;
    widening = inversesqrt(max(kept, 1e-6));
    // unlike what is kept, this goes on rising towards the camera, or the last blades would never be full-grown
    float ratio = sward.full_density_m / max(distance_m, 1e-3), risen = ratio * ratio * view.density;
    if (rank > view.density || risen <= 0.0) return 0.0;
    float edge = 1.0 - smoothstep(0.82, 1.0, distance_m / sward.reach_m);
    return edge * clamp((risen - rank) / (0.2 * risen), 0.0, 1.0);
#endif
}
