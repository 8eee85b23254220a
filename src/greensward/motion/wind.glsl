// The wind at a point and time: every wind of the scene, added up.
#include "layout/Winds"
#include "motion/gusts.glsl"
#include "motion/strong.glsl"
#include "motion/helicopter.glsl"
#include "motion/random.glsl"
#include "motion/waves.glsl"
#include "motion/blast.glsl"
#include "motion/whirl.glsl"
#include "motion/texture.glsl"
#include "motion/ripples.glsl"

#include "layout/WindAt"
