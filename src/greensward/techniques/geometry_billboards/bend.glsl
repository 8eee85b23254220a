// The billboard of a blade: bent by a force, and round where it stands for a tube (Derstroff 2024).

// Section 2.2: p' = p + (f_x h^2, -|f| h, f_z h^2), at the height h from 0 at the root to 1
vec3 bent(vec3 p, vec2 f, float h) { return p + vec3(f.x * h * h, -length(f) * h, f.y * h * h); }

// Derivative of that along h, of a blade that stands `tall`
vec3 bentAlong(float tall, vec2 f, float h) { return vec3(2.0 * f.x * h, tall - length(f), 2.0 * f.y * h); }

// Section 2.1: the right vector, a row of the view matrix; projection only scales it
vec3 rightOf(mat4 clip_from_relative) {
    return normalize(vec3(clip_from_relative[0][0], clip_from_relative[1][0], clip_from_relative[2][0]));
}

// The source's quads stand upright, and would be seen edge-on from above. There they lie square to the blade instead.
vec3 acrossBillboard(vec3 right, vec3 chord, vec3 toViewer) {
    vec3 square = cross(chord, toViewer);
    float size = length(square), above = smoothstep(0.5, 0.9, abs(toViewer.y));
    if (size < 1e-4 || above == 0.0) return right;
    square *= (dot(square, right) < 0.0 ? -1.0 : 1.0) / size;
    return normalize(mix(right, square, above));
}

// Section 4.2: how far a tube stands out towards the viewer, in its radius: 1 at the middle, 0 at the edges of the billboard
float tubeOffset(float u) {
    float s = 2.0 * u - 1.0;
    return sqrt(max(1.0 - s * s, 0.0));
}

// Section 4.2: its normal points from the middle of the tube to that point
vec3 tubeNormal(vec3 side, vec3 toViewer, float u) { return (2.0 * u - 1.0) * side + tubeOffset(u) * toViewer; }
