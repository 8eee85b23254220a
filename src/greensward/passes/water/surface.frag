#include "passes/water/surface.glsl"

void main() {
    Surface s;
    float depth_m;
    if (!surfaceAt(ivec2(gl_FragCoord.xy), s, depth_m)) discard;
    emitSurface(s, depth_m);
}
