// Blades deferred to later shaders, in any order: those too large for one invocation, and with 32 bits those whose ids are
// still to be written, which follow them in the same buffer.
#include "layout/DeferredLists"

layout(std430) buffer Lists { DeferredLists lists; };
layout(std430) buffer Deferred { uint deferred[]; };

uniform uint list_capacity;  // blades of each list

const int LARGE = 0, WON = 1;

uint deferredBlade(int list, uint item) { return deferred[uint(list) * list_capacity + item]; }

void defer(int list, uint blade) { deferred[uint(list) * list_capacity + atomicAdd(lists.gathered[list], 1u)] = blade; }

// Blades that are drawn, summed in parts so that few invocations meet at one
void countDrawn(uint part) { atomicAdd(lists.drawn[part % uint(lists.drawn.length())], 1u); }
