"""Winds of a scene, which add up: `Scene(wind=[winds.Gusts()])`."""

from greensward.scene.wind import Blast, Gusts, Helicopter, Idle, Random, Ripples, Strong, Texture, Wake, Waves, Whirl

__all__ = [
    "Blast",
    "Gusts",
    "Helicopter",
    "Idle",
    "Random",
    "Ripples",
    "Strong",
    "Texture",
    "Wake",
    "Waves",
    "Whirl",
]
