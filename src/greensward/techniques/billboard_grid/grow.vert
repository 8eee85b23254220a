// A blade as it stands in still air, seen from the side or from above, for the texture of a billboard.
#include "culling/blades.glsl"
#include "techniques/blades/blade_material.glsl"
#include "techniques/blades/normal.glsl"
#include "techniques/blades/outlines.glsl"

in uint number;      // of the blade on its page
in vec3 moved_m;     // to its other end where it stands across an edge, so that copies side by side have no seam
in float order;      // among those of the billboard, from 1

uniform vec3 across, upwards, outwards;  // axes of the picture in space, the last towards the viewer
uniform vec3 low_m, high_m;              // what the picture shows, along these axes
uniform float texel_m;

const float SEGMENTS = 10.0;

flat out Material material;
out vec3 normal;     // along the axes
out float along;     // 0 at the root to 1 at the tip
flat out float rank;
flat out float bladeNumber;

void main() {
    Blade b = blades[number];
    float v = float(gl_VertexID >> 1) / SEGMENTS, u = float(gl_VertexID & 1);
    vec3 root = bladeRoot(b) + moved_m, control = bladeControl(b) + moved_m, tip = bladeTip(b) + moved_m;
    vec3 chord = normalize(tip - root), trueSide = acrossOf(b, chord), side = drawnSide(trueSide, chord, outwards);
    float wide = max(b.width, texel_m), part = shapeParameter(int(species(bladeSpecies(b), MIX).z + 0.5), u, v, wide / texel_m);
    vec3 point = bezierPoint(root, control, tip, v) + wide * (part - 0.5) * side;
    vec3 at = (vec3(dot(point, across), dot(point, upwards), dot(point, outwards)) - low_m) / (high_m - low_m);
    gl_Position = vec4(2.0 * at.xy - 1.0, 1.0 - 2.0 * at.z, 1.0);

    vec3 shade = shadeOf(b), rootColour, tipColour;
    bladeColours(b, shade, rootColour, tipColour);
    material = Material(vec4(rootColour, 0.0), vec4(tipColour, 0.0), 1.0, 0.0, 1.0, vec3(0.0), 0.0);
    vec3 facing = normalize(leafNormal(trueSide, side, bezierTangent(root, control, tip, v), outwards, u, vec3(0.0), 0.0));
    normal = vec3(dot(facing, across), dot(facing, upwards), dot(facing, outwards));
    along = v;
    rank = bladeRank(b);
    bladeNumber = order;
}
