"""Forces that press the grass down or push it aside: `Scene(force=[forces.Tracks(path=[(0, 0), (12, 5)])])`."""

from greensward.scene.force import Footprints, ForceMap, Stamp, Tracks

__all__ = ["Footprints", "ForceMap", "Stamp", "Tracks"]
