// What the pipeline's stages need of a blade that is drawn, in 72 bytes.
#include "shaders/blade.glsl"

struct Record {
    float x, y, z;        // root in relative space, metres
    float width;          // metres, as drawn
    uint now[3];          // control point and tip from the root, as in Posture
    uint side;            // octahedral, as drawn: turned to the viewer where the blade would vanish
    uint previous[3];     // one frame ago
    uint trueSide;        // octahedral, for the shading normal
    uint rootColour;      // square root of the colour; transmittance
    uint tipColour;       // square root of the colour; roughness
    uint look;            // height over four times the canopy's, 0 near to 1 far; share of the area drawn
    uint wall;            // octahedral, the shading normal of far blades
    uint blade;           // index within its page
    uint levelAndShape;   // segments, 0 where nothing is drawn; shape
};
