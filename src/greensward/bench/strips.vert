// Baseline: an instance a blade, its seven vertices bent by a sine that travels over the field
#include "shaders/blade.glsl"

layout(std430) readonly buffer Blades { Blade blades[]; };
uniform mat4 clip_from_world;
uniform float time_s;
out float along;

void main() {
    Blade b = blades[gl_InstanceID];
    float v = float(gl_VertexID >> 1) / 3.0, u = gl_VertexID == 6 ? 0.0 : float(gl_VertexID & 1) - 0.5;
    vec3 side = vec3(cos(b.facing), 0.0, sin(b.facing)) * b.width * (1.0 - v * v);
    vec3 control = vec3(b.x1, b.y1, b.z1), tip = vec3(b.x2, b.y2, b.z2);
    tip.x += 0.2 * b.height * (1.0 - b.stiffness) * sin(2.0 * time_s + 0.5 * (b.x + b.z));
    vec3 point = vec3(b.x, b.y, b.z) + 2.0 * v * (1.0 - v) * control + v * v * tip + u * side;
    along = v;
    gl_Position = clip_from_world * vec4(point, 1.0);
}
