// Quadratic Bezier curves.

vec3 bezierPoint(vec3 v0, vec3 v1, vec3 v2, float t) { return mix(mix(v0, v1, t), mix(v1, v2, t), t); }

// Not of unit length
vec3 bezierTangent(vec3 v0, vec3 v1, vec3 v2, float t) { return mix(v1 - v0, v2 - v1, t); }

// Approximate length (Jahrmann & Wimmer 2017, after Gravesen 1997): L = (2 L0 + (n - 1) L1) / (n + 1), n = 2
float bezierLength(vec3 v0, vec3 v1, vec3 v2) {
    return (2.0 * distance(v0, v2) + distance(v0, v1) + distance(v1, v2)) / 3.0;
}

// Scale both legs so that the curve has this length (Jahrmann & Wimmer 2017). Measured in two halves: over the whole
// of a blade that folds over, the formula is off by a quarter.
void keepLength(vec3 v0, inout vec3 v1, inout vec3 v2, float length_m) {
    vec3 lower = mix(v0, v1, 0.5), higher = mix(v1, v2, 0.5), middle = mix(lower, higher, 0.5);
    float ratio = length_m / max(bezierLength(v0, lower, middle) + bezierLength(middle, higher, v2), 1e-6);
    vec3 upper = (v2 - v1) * ratio;
    v1 = v0 + (v1 - v0) * ratio;
    v2 = v1 + upper;
}
