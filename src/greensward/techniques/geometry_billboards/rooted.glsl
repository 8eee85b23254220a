// What the geometry stage needs of a root to make a billboard of it.
struct Rooted {
    vec3 root;            // in relative space
    vec4 shape;           // height, 0 where no blade grows; width; random number; unused
    vec4 force;           // that bends the tip, metres along x and z: now, and one frame ago
    vec3 side;            // across the blade as it grew, for the shading normal
    uvec4 material;       // square roots of root and tip colour, with transmittance and roughness; tall, far; wall
    uint dry;             // square root of the dry colour
    uvec2 numberAndTexture;
};
