// The width of a leaf for the tests of culling, with the distance that these quads may have from the curve of their posture.
#define widthOf widthOfLeaf
#include "techniques/leaf.glsl"
#undef widthOf

float widthOf(Blade b, Hull h) {
    float wide = widthOfLeaf(b, h);
    return wide > 0.0 ? wide + leaf.slack_m : wide;
}
