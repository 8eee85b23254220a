// A blade as a quad whose left and right edges are bent into two parallel splines (Jahrmann & Wimmer 2013, sections 4 and 5).

// Equation 2, turned about the blade's centre by a random angle, which gives `side`: lower left, lower right, upper right and
// upper left corner. `up` is the paper's y.
void outline(vec3 centre, vec3 side, vec3 up, float width, float height, out vec3 corners[4]) {
    corners[0] = centre - 0.5 * width * side;
    corners[1] = centre + 0.5 * width * side;
    corners[2] = corners[1] + height * up;
    corners[3] = corners[0] + height * up;
}

float between(vec2 ends, float random) { return ends.x + random * (ends.y - ends.x); }

// Equation 3: along the paper's x and z
vec2 tipOffset(float bending, vec2 random) { return bending * (2.0 * random - 1.0); }

// Equation 4. At the farthest distance it is 0, which culls the blade.
float levelByDistance(float smoothness, float distance_m, float farthest_m) {
    return max(ceil(smoothness * (1.0 - distance_m / farthest_m)), 0.0);
}

// Equation 5; upper and lower are y in normalised device coordinates. The tessellator rounds up, and culls at 0 and below.
float levelBySize(float smoothness, float upper, float lower, float height_px, float px_per_quad) {
    return min(((upper * 0.5 + 0.5) - (lower * 0.5 + 0.5)) * height_px / px_per_quad, smoothness);
}

// Along the blade in place of up the screen, so that one that lies or points down keeps its quads, and one at least
float levelByLength(float smoothness, vec2 upper, vec2 lower, vec2 size_px, float px_per_quad) {
    return clamp(length(0.5 * (upper - lower) * size_px) / px_per_quad, 1.0, smoothness);
}

// Equation 6. The paper's text puts the point above the lower vertex, at the height of the upper one, varied a little; the
// ranges that are printed for R1 and R2 would put it below the upper vertex. So they are exchanged here: R1 lies between 3/4
// and 5/4, R2 between -1/4 and 1/4.
vec3 controlPoint(vec3 lower, vec3 upper, vec3 up, vec2 r) {
    float height = dot(lower, up) * r.y + dot(upper, up) * (1.0 - r.y);
    vec3 level = (lower - up * dot(lower, up)) * r.x + (upper - up * dot(upper, up)) * (1.0 - r.x);
    return level + up * height;
}

// Equation 7, De Casteljau
vec3 spline(vec3 bottom, vec3 h, vec3 top, float v, out vec3 tangent) {
    vec3 a = bottom + v * (h - bottom), b = h + v * (top - h);
    tangent = (b - a) / max(length(b - a), 1e-9);
    return a + v * (b - a);
}

// Equation 8
struct Point { vec3 position, bitangent, tangent, normal; };

Point pointOn(vec3 left, vec3 tangentLeft, vec3 right, vec3 tangentRight, float u) {
    Point p;
    p.position = left * (1.0 - u) + right * u;
    p.bitangent = normalize(right - left);
    p.tangent = normalize(tangentLeft * (1.0 - u) + tangentRight * u);
    p.normal = normalize(cross(p.tangent, p.bitangent));
    return p;
}
