// Whether a view shows a blade, by the tests that the scene asks for.
#include "culling/blade_bounds.glsl"
#include "culling/tests.glsl"
#include "culling/width"
#ifdef OCCLUSION
#include "culling/occlusion.glsl"
#endif

bool isVisible(uint index, out Blade b, out BladeBounds h, out float width) {
    if (!boundsOf(index, b, h)) return false;
    width = widthOf(b, h);
    if (width < 0.0) return false;
#ifdef ORIENTATION
    if (width == 0.0) return false;
#endif
#ifdef FRUSTUM
    if (outside(h.v0, h.v1, h.v2, width)) return false;
#endif
#ifdef OCCLUSION
    if (hidden(h.v0, h.v1, h.v2, width)) return false;
#endif
    return true;
}
