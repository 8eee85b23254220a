"""Objects among the grass: `Scene(object=[objects.Sphere(position_m=(0, 0, 0))])`."""

from greensward.scene.objects import Box, Capsule, Cylinder, Fur, Mesh, Path, Sphere

__all__ = ["Box", "Capsule", "Cylinder", "Fur", "Mesh", "Path", "Sphere"]
