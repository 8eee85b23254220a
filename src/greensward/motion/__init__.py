"""WHAT MOVES the blades: winds, forces, colliders, and the posture that each takes, from memory or in closed form."""

from greensward.motion.colliders import Colliders
from greensward.motion.force_map import Forces, absent_forces
from greensward.motion.postures import Postures, motion_defines
from greensward.motion.simulation import Remembering, Simulated
from greensward.motion.winds import Winds

__all__ = ["Colliders", "Forces", "Postures", "Remembering", "Simulated", "Winds", "absent_forces", "motion_defines"]
