// A square for each 16 x 16 pixels, of no extent where none of them shows a blade of this page: a CPU driver would run the
// fragment shader for all of them.
#include "techniques/visibility_buffer/cells.glsl"

const int TILE = 16;

uniform uint firstName;
uniform uint bladeCount;

void main() {
    ivec2 size = ivec2(view.size_px.xy);
    int columns = (size.x + TILE - 1) / TILE;
    ivec2 first = TILE * ivec2(gl_InstanceID % columns, gl_InstanceID / columns);
    ivec2 end = min(first + TILE, size);
    bool shows = false;
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            float nearness;
            shows = shows || (readCell(cellOf(ivec2(x, y)), nearness) - firstName) >> 5u < bladeCount;
        }
    }
    ivec2 corner = first + (end - first) * ivec2(gl_VertexID & 1, gl_VertexID >> 1);
    if (!shows) corner = ivec2(0);
    gl_Position = vec4(vec2(corner) * view.size_px.zw * 2.0 - 1.0, 0.0, 1.0);
}
