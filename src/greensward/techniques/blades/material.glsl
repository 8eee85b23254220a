// Material of a leaf, and the surface at each of its points.
#include "layout/SurfaceClass"
#include "shaders/surface.glsl"

// Where less is drawn one sees deeper, past as many blades; what shows there is shaded as what would have shown of all. If
// the area above a place grew as the cube of how far that is below the tips, all of them would show it closer to the tips by
// the cube root of the share that is drawn; fitted with scripts/measure_detail.py it is a little less. The tallest bend the
// least: their normals differ less.
const float HIGHER = 0.34, TURNED = 0.12;

float higher(float at, float share, float power) { return mix(1.0, at, pow(share, power)); }

// What makes a blade differ from others of its species: a factor, of a number from -0.5 to 0.5
vec3 shadeOf(float tint) { return vec3(1.0 + 0.55 * tint, 1.0 + 0.38 * tint, 1.0 + 0.1 * tint); }

struct Material {
    vec4 root;   // colour, transmittance
    vec4 tip;    // colour, roughness
    float tall;  // its height over the canopy's
    float far;   // 0 near to 1 where it stands for many
    float share; // of all area, that is drawn around it
    vec3 wall;   // the normal of what it stands for
    float mapped; // how much of its colour the vegetation map gives
};

// At v from root to tip; normal, id and motion are left to be filled in
Surface leafSurface(Material material, float v) {
    float height = higher(clamp(material.tall * v, 0.0, 1.0), material.share, HIGHER);
    v = higher(v, material.share, HIGHER);
    Surface s;
    s.baseColour = mix(material.root.rgb, material.tip.rgb, smoothstep(0.0, 0.85, v));
    // thin at the tip; dark where the sward closes over it, less so where one far blade stands for many
    s.transmittance = material.root.w * mix(0.45, 1.0, v);
    s.roughness = material.tip.w;
    s.occlusion = mix(mix(0.2, 0.8, material.far), 1.0, height * (2.0 - height));
    s.surfaceClass = CLASS_GRASS;
    return s;
}
