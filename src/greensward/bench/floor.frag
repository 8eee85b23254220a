out vec4 colour;

void main() { colour = vec4(0.2, 0.4, 0.1, 1.0); }
