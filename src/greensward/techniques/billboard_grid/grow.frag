#include "techniques/blades/material.glsl"

flat in Material material;
in vec3 normal;
in float along;
flat in float rank;
flat in float bladeNumber;

layout(location = 0) out vec4 colour;  // all but the number are averaged later, and so all are times opacity
layout(location = 1) out vec4 shape;   // normal across and upwards, as 0 to 1; rank; place along the blade
layout(location = 2) out float blade;

void main() {
    colour = vec4(leafSurface(material, along).baseColour, 1.0);
    shape = vec4(0.5 + 0.5 * normalize(normal).xy, rank, along);
    blade = bladeNumber;
}
