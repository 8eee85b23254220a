// The depth that was drawn into the visibility buffer, into a shadow map.
#include "techniques/visibility_buffer/visibility.glsl"

void main() {
    float inverse_depth = uintBitsToFloat(inverse_depths[pixelIndex(ivec2(gl_FragCoord.xy))]);
    if (inverse_depth == 0.0) discard;
    gl_FragDepth = 1.0 - inverse_depth;
}
