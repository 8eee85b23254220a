// Strips of five triangles strewn over the picture, from nothing but their numbers
#include "shaders/hash.glsl"

uniform vec2 size;  // width and height of a strip, in clip space

void main() {
    vec2 at = 2.0 * unit(hash3(uvec3(gl_InstanceID, 1u, 2u))).xy - 1.0;
    vec2 within = vec2(float(gl_VertexID & 1) - 0.5, float(gl_VertexID >> 1) / 3.0) * size;
    gl_Position = vec4(at + within, 0.5, 1.0);
}
