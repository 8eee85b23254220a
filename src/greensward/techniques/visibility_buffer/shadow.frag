// The depth that was drawn into the cells, into a shadow map.
#include "techniques/visibility_buffer/cells.glsl"

void main() {
    float nearness = uintBitsToFloat(nearest[cellOf(ivec2(gl_FragCoord.xy))]);
    if (nearness == 0.0) discard;
    gl_FragDepth = 1.0 - nearness;
}
