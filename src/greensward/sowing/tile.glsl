// A square of ground, or a group of an object's triangles, in which so many blades are tried
struct Tile { int x, z, level; uint candidates; };
