// A blade between the vertex and the evaluation stage.
struct Outlined {
    vec3 corners[4];    // equation 2, with the upper ones offset; in relative space
    vec3 before;        // from a lower to an upper corner, one frame ago
    vec3 up;
    vec3 trueSide;      // from the left to the right edge, before it was turned to the viewer
    vec4 shape;         // R1 and R2 of equation 6; smoothness, 0 where nothing is drawn; rank
    uvec4 material;     // packed: colours of root and tip; height over four times the canopy, distance, share, map; wall
    uvec3 identity;     // id; species; three random values, packed
};
