#define SURFACE_IMAGES
#include "shaders/emit.glsl"
#include "techniques/billboard_grid/surface.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    Surface surface;
    float depth_m;
    if (any(greaterThanEqual(pixel, ivec2(view.size_px.xy))) || !surfaceAt(pixel, surface, depth_m)) return;
    emitSurface(surface, pixel, depth_m);
}
