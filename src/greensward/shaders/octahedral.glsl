// Unit vectors in two numbers (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors").
vec2 octahedralEncode(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 e = n.xz;
    vec2 outward = vec2(e.x >= 0.0 ? 1.0 : -1.0, e.y >= 0.0 ? 1.0 : -1.0);
    return n.y >= 0.0 ? e : (1.0 - abs(e.yx)) * outward;
}

vec3 octahedralDecode(vec2 e) {
    vec3 n = vec3(e.x, 1.0 - abs(e.x) - abs(e.y), e.y);
    float below = max(-n.y, 0.0);
    n.x += n.x >= 0.0 ? -below : below;
    n.z += n.z >= 0.0 ? -below : below;
    return normalize(n);
}
