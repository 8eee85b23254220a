"""Kinds of ground: `Scene(ground=grounds.NoiseGround())`."""

from greensward.scene.ground import EndlessGround, FlatGround, HeightMapGround, NoGround, NoiseGround

__all__ = ["EndlessGround", "FlatGround", "HeightMapGround", "NoGround", "NoiseGround"]
