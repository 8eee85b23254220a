// Quadratic Bezier curves.

vec3 bezierPoint(vec3 v0, vec3 v1, vec3 v2, float t) { return mix(mix(v0, v1, t), mix(v1, v2, t), t); }

// Not of unit length
vec3 bezierTangent(vec3 v0, vec3 v1, vec3 v2, float t) { return mix(v1 - v0, v2 - v1, t); }

// Approximate length (Jahrmann & Wimmer 2017, after Gravesen 1997): L = (2 L0 + (n - 1) L1) / (n + 1), n = 2
float bezierLength(vec3 v0, vec3 v1, vec3 v2) {
    return (2.0 * distance(v0, v2) + distance(v0, v1) + distance(v1, v2)) / 3.0;
}

float primitive(float s, float h) {
    float r = sqrt(s * s + h * h);
    return 0.5 * (s * r + h * h * sign(s) * log((abs(s) + r) / h));
}

// Exact length: the speed of the curve is 2 |d1 + t e|, the root of a quadratic. Where the curve is nearly straight that
// cancels, and the formula above is as good; over a blade that folds over it is off by a third.
float arcLength(vec3 v0, vec3 v1, vec3 v2) {
    vec3 d1 = v1 - v0, e = v2 - v1 - d1;
    float bend = length(e);
    if (bend < 0.05 * length(d1) + 1e-9) return bezierLength(v0, v1, v2);
    float s = dot(d1, e) / bend, h = sqrt(max(dot(d1, d1) - s * s, 1e-12 * bend * bend));
    return 2.0 * (primitive(s + bend, h) - primitive(s, h)) / bend;
}

// Scale both legs so that the curve has this length (Jahrmann & Wimmer 2017)
void correctLength(vec3 v0, inout vec3 v1, inout vec3 v2, float length_m) {
    float ratio = length_m / max(arcLength(v0, v1, v2), 1e-6);
    vec3 upper = (v2 - v1) * ratio;
    v1 = v0 + (v1 - v0) * ratio;
    v2 = v1 + upper;
}
