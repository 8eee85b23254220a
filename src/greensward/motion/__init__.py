"""WHAT MOVES the blades: winds, colliders, and the posture that each blade takes, from memory or in closed form."""

from greensward.motion.colliders import Colliders
from greensward.motion.postures import Postures, motion_defines
from greensward.motion.simulation import Remembering, Simulated
from greensward.motion.winds import Winds

__all__ = ["Colliders", "Postures", "Remembering", "Simulated", "Winds", "motion_defines"]
