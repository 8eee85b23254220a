"""Motion, WHAT MOVES the blades: winds, forces, colliders, and the pose that each takes, simulated or analytic."""

from greensward.motion.colliders import Colliders
from greensward.motion.force_map import Forces, absent_forces
from greensward.motion.poses import Poses, motion_defines
from greensward.motion.simulation import BladeSimulation, SimulatedRanges
from greensward.motion.stateful import MotionStep, Stateful
from greensward.motion.winds import Winds, same_kinds

__all__ = [
    "BladeSimulation",
    "Colliders",
    "Forces",
    "MotionStep",
    "Poses",
    "SimulatedRanges",
    "Stateful",
    "Winds",
    "absent_forces",
    "motion_defines",
    "same_kinds",
]
