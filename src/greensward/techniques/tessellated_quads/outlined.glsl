// A blade between the vertex and the evaluation stage.
struct Outlined {
    vec3 root;      // in relative space
    vec3 up;
    vec3 side;      // from the left to the right edge
    vec3 tip;       // middle of the upper edge, from the root, now
    vec3 before;    // and one frame ago
    vec3 trueSide;  // before it was turned to the viewer
    vec4 shape;     // R1 and R2 of equation 6; smoothness, 0 where nothing is drawn; rank
    uvec4 material;     // packed: colours of root and tip; height over four times the canopy, distance, share, map; wall
    uvec2 numberAndSpecies;     // id; species
};
