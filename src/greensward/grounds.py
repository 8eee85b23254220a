"""Kinds of ground: `Scene(ground=grounds.NoiseGround())`."""

from greensward.scene.ground import FlatGround, HeightMapGround, NoGround, NoiseGround

__all__ = ["FlatGround", "HeightMapGround", "NoGround", "NoiseGround"]
