// Width that culling tests a blade with: that of a leaf, and how far these quads may be from the curve of their pose.
#include "techniques/blades/leaf.glsl"

float widthOf(Blade b, BladeBounds h) {
    float wide = leafWidth(b, h);
    return wide > 0.0 ? wide + leaf.slack_m : wide;
}
