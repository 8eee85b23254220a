// Winds as forces on blades of some mass (Derstroff, section 4.3): f = m a.
#include "shaders/blade.glsl"
#include "motion/air.glsl"
#include "layout/Motion"

const float MOST_FORCE = 10.0;  // times what moves a blade of the reference mass: the lightest weigh next to nothing

// What a wind gives is the acceleration of a blade of the reference mass: the force is that times the reference mass, and the
// acceleration of another blade the force over its own mass. `mass` is in reference masses.
Air forced(Air air, float mass) {
    float part = min(1.0 / max(mass, 1e-6), MOST_FORCE);
    return Air(part * air.wind, part * air.blast);
}

// Of a surface density by species, two thirds of its length times its greatest width: the area of a parabola
float massOf(Blade b) { return motion.mass_per_m2[bladeSpecies(b) >> 2][bladeSpecies(b) & 3] * b.height * b.width; }
