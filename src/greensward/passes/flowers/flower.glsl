// A plant as it stands at this instant; without height where none grows.
struct Flower {
    vec4 root;     // xyz in the world; height
    vec4 control;  // of the stem's curve, from the root; width of the picture
    vec4 tip;      // from the root; random number
    vec4 controlBefore;
    vec4 tipBefore;
};
