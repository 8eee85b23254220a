// How much of a blade is there: blades thin out with distance, and each grows in rather than pops in.
#include "shaders/blade.glsl"
#include "sowing/sward.glsl"
#include "block/View"

// 1 where the blade is fully there, less while it grows in, 0 where it is left out.
// `widening` is what the blades that stay make up for those left out.
float presence(Blade b, float distance_m, out float widening) {
    float kept = keptShare(distance_m) * view.density;
    widening = inversesqrt(max(kept, 1e-6));
    float edge = 1.0 - smoothstep(0.82, 1.0, distance_m / sward.reach_m);
    return edge * clamp((kept - bladeRank(b)) / (0.2 * kept), 0.0, 1.0);
}
