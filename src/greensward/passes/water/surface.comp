#define SURFACE_IMAGES
#include "passes/water/surface.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    Surface s;
    float depth_m;
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy))) || !surfaceAt(pixel, s, depth_m)) return;
    emitSurface(s, pixel, depth_m);
}
