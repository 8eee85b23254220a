// Where the extra blades of a root stand (Tillman 2013, section 2.1.2), in the plane of the ground around it.

const float GOLDEN = 2.39996323;  // radians

// Of extra blade k of so many, from 1 on: even over a disc as large as the ground that a root has to itself. `turn` is the
// root's own, in turns.
vec2 offsetOf(int k, int extra, float spacing_m, float turn) {
    float radius = spacing_m * sqrt((float(k) + 0.5) / (3.14159265 * (float(extra) + 1.0)));
    float angle = 6.28318531 * turn + GOLDEN * float(k);
    return radius * vec2(cos(angle), sin(angle));
}

// Neighbours lie in the four quadrants around a root, numbered by their signs
int quadrantOf(vec2 place) { return (place.x < 0.0 ? 1 : 0) ^ (place.y < 0.0 ? 3 : 0); }

// Parts of neighbours a and b, the rest being the root's, at a place in the triangle of all three; on its far edge beyond it
vec2 partsOf(vec2 place, vec2 a, vec2 b) {
    float area = a.x * b.y - a.y * b.x;
    vec2 parts = abs(area) < 1e-12 ? vec2(0.0) : vec2(place.x * b.y - place.y * b.x, a.x * place.y - a.y * place.x) / area;
    parts = max(parts, 0.0);
    return parts / max(parts.x + parts.y, 1.0);
}

// What a neighbour says of the height at a place: halfway between its own height and its plane there. The sum of all three by
// their parts is exact where the land is curved alike everywhere: heights alone would leave out what is between them, and
// planes alone would add it twice.
float heightFrom(vec2 place, vec2 neighbour, float above, vec2 slope) { return above + 0.5 * dot(slope, place - neighbour); }
