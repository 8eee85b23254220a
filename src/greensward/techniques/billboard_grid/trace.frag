#include "shaders/emit.glsl"
#include "techniques/billboard_grid/surface.glsl"

void main() {
    Surface surface;
    float depth_m;
    if (!surfaceAt(ivec2(gl_FragCoord.xy), surface, depth_m)) discard;
    emitSurface(surface, depth_m);
}
