"""WHAT MOVES the blades: winds, and the posture that each blade takes in them."""

from greensward.motion.postures import Postures

__all__ = ["Postures"]
