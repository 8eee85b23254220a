// Depth that depth_pyramid.comp builds on: that of the G-buffer.
#include "shaders/gbuffer.glsl"

ivec2 pictureSize() { return textureSize(gbuffer_surface, 0); }

float baseDepth(ivec2 pixel) { return depthAt(pixel); }
