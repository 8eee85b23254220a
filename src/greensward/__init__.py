"""Living grass for Python and OpenGL: millions of blades, each swaying on its own."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from greensward.io.camera_path import CameraPath
    from greensward.library import dump, load, presets
    from greensward.renderer import Counts, Frame, Renderer
    from greensward.scene import (
        Blast,
        Box,
        Camera,
        Capsule,
        Culling,
        Cylinder,
        FlatGround,
        Flowers,
        Footprints,
        ForceMap,
        Fur,
        Grass,
        GreenswardError,
        Growth,
        Gusts,
        HeightMapGround,
        Helicopter,
        InputError,
        Mesh,
        NoGround,
        NoiseGround,
        Path,
        Post,
        Random,
        Ripples,
        Scene,
        SceneError,
        Shadows,
        Simulation,
        Sky,
        Sowing,
        Sphere,
        Stamp,
        Strong,
        Sun,
        TechniqueChoice,
        Texture,
        Tracks,
        Water,
        Waves,
        Whirl,
    )
    from greensward.viewer.notebook import show

__version__ = "0.1.0"

_HOMES = {
    "dump": "library",
    "load": "library",
    "presets": "library",
    "CameraPath": "io.camera_path",
    "Counts": "renderer",
    "Frame": "renderer",
    "Renderer": "renderer",
    "show": "viewer.notebook",
}

__all__ = [
    "Blast",
    "Box",
    "Camera",
    "CameraPath",
    "Capsule",
    "Counts",
    "Culling",
    "Cylinder",
    "FlatGround",
    "Flowers",
    "Footprints",
    "ForceMap",
    "Frame",
    "Fur",
    "Grass",
    "GreenswardError",
    "Growth",
    "Gusts",
    "HeightMapGround",
    "Helicopter",
    "InputError",
    "Mesh",
    "NoGround",
    "NoiseGround",
    "Path",
    "Post",
    "Random",
    "Renderer",
    "Ripples",
    "Scene",
    "SceneError",
    "Shadows",
    "Simulation",
    "Sky",
    "Sowing",
    "Sphere",
    "Stamp",
    "Strong",
    "Sun",
    "TechniqueChoice",
    "Texture",
    "Tracks",
    "Water",
    "Waves",
    "Whirl",
    "dump",
    "load",
    "presets",
    "show",
]


def __getattr__(name: str) -> Any:
    # the command line answers --help without waiting for NumPy and OpenGL to load
    if name not in __all__:
        raise AttributeError(f"module 'greensward' has no attribute {name!r}")
    return getattr(import_module(f"greensward.{_HOMES.get(name, 'scene')}"), name)
