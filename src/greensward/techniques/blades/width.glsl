// Width that culling tests a blade with: that of a leaf as it is drawn.
#include "techniques/blades/leaf.glsl"

float widthOf(Blade b, BladeBounds h) { return leafWidth(b, h); }
