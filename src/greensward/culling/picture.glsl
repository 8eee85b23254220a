// What pyramid.comp builds on: the depth of a picture.
layout(binding = 14) uniform sampler2D picture;

ivec2 pictureSize() { return textureSize(picture, 0); }

float depthOf(ivec2 pixel) { return texelFetch(picture, pixel, 0).r; }
