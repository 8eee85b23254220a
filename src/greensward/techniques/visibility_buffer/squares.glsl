// Squares of the picture that show a blade, by their first pixel, in any order: instances of an indirect draw.
#include "layout/DrawCommand"

const int SQUARE = 4;

layout(std430) buffer Squares {
    DrawCommand square_command;
    uint squares[];
};
