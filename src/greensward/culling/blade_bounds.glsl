// Bounds of a blade of a page, by its index.
#include "culling/bounds.glsl"
#include "culling/blades.glsl"

// False where none grows, or the distance leaves it out
bool boundsOf(uint index, out Blade b, out BladeBounds h) {
    if (!fetchBlade(index, b) || !startBounds(b, h)) return false;
    poseNow(index, b, h.v0, h.v1, h.v2);
    shrinkByFade(h);
    return true;
}
