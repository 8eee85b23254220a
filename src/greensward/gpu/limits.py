"""Numbers of bindings that a shader uses at most: what OpenGL 4.3 and WebGPU promise, or fewer."""

MOST_STORAGE_BLOCKS = 8
MOST_UNIFORM_BLOCKS = 10
MOST_TEXTURES = 16
MOST_IMAGES = 4
