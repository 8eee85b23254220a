// Blades put off for later shaders, in any order: those too large for one invocation, and with 32 bits those to be named.
layout(std430, binding = 7) buffer Lists {
    uint gathered[2];    // blades in the lists that are being written
    uint listed[2];      // and in those that are read
    uint largeGroups[3];
    uint wonGroups[3];
};
layout(std430, binding = 8) buffer Large { uint large[]; };
layout(std430, binding = 9) buffer Won { uint won[]; };

const int LARGE = 0, WON = 1;
