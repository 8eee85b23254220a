"""Winds of a scene, which add up: `Scene(wind=[winds.Gusts()])`."""

from greensward.scene.wind import Blast, Gusts, Helicopter, Random, Ripples, Strong, Texture, Waves, Whirl

__all__ = ["Blast", "Gusts", "Helicopter", "Random", "Ripples", "Strong", "Texture", "Waves", "Whirl"]
