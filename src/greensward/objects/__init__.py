"""Objects as surfaces: triangles in their own space, and the spheres that fill them."""

from greensward.io.meshes import TriMesh
from greensward.objects.meshes import mesh_of
from greensward.objects.packing import packed

__all__ = ["TriMesh", "mesh_of", "packed"]
