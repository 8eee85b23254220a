// Squares of the picture that show a blade, by their first pixel, in any order: instances of an indirect draw.
const int SQUARE = 4;

layout(std430, binding = 11) buffer Squares {
    uint vertices, instances, firstVertex, firstInstance, unused;
    uint squares[];
};
