// The depth that was drawn into the visibility buffer, into a shadow map.
#include "techniques/visibility_buffer/visibility.glsl"

void main() {
    float nearness = uintBitsToFloat(nearnesses[pixelIndex(ivec2(gl_FragCoord.xy))]);
    if (nearness == 0.0) discard;
    gl_FragDepth = 1.0 - nearness;
}
