in float along;
out vec4 colour;

void main() { colour = vec4(mix(vec3(0.10, 0.20, 0.05), vec3(0.45, 0.60, 0.20), along), 1.0); }
