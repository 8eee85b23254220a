// Outlines of a blade (Jahrmann & Wimmer 2017): a point between the left and right edge i1, i2 at (u, v).
const int QUAD = 0, TRIANGLE = 1, QUADRATIC = 2, QUADRATIC_3D = 3, MINIMUM_WIDTH = 4, TRIANGLE_TIP = 5, DANDELION = 6;

// How far from the left edge to the right one. `widthPx` is the blade's width on the screen.
float shapeParameter(int shape, float u, float v, float widthPx) {
    switch (shape) {
        case QUAD: return u;
        case TRIANGLE: return u + 0.5 * v * (1.0 - 2.0 * u);
        case QUADRATIC:
        case QUADRATIC_3D: return u - v * v * u;
        case MINIMUM_WIDTH: return max(u - v * v * u, clamp(0.5 * (3.0 - widthPx), 0.0, 1.0) * u);
        case TRIANGLE_TIP: return mix(u, 0.5, clamp(2.0 * v - 1.0, 0.0, 1.0));
        default: {
            // dandelion: three pairs of lobes on a leaf that widens towards its tip
            float lobes = 2.0 * abs(sin(4.71238898 * v)) * abs(cos(4.71238898 * v));
            float reach = (0.32 + 0.68 * lobes) * smoothstep(0.0, 0.7, v) * (1.0 - smoothstep(0.9, 1.0, v)) + 0.08 * (1.0 - v);
            return 0.5 + (u - 0.5) * reach;
        }
    }
}

// How far the middle stands out along the normal, in widths
float shapeFold(int shape, float u, float v) {
    return shape == QUADRATIC_3D ? (0.5 - abs(u - 0.5)) * (1.0 - v) : 0.0;
}
