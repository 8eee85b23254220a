"""Living grass for Python and OpenGL: millions of blades, each swaying on its own."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from greensward.library import dump, load, presets
    from greensward.renderer import Frame, Renderer
    from greensward.scene import (
        Camera,
        FlatGround,
        Grass,
        GreenswardError,
        Gusts,
        HeightMapGround,
        InputError,
        NoiseGround,
        Post,
        Scene,
        SceneError,
        Shadows,
        Sky,
        Solid,
        Sowing,
        Sun,
        TechniqueChoice,
    )

__version__ = "0.1.0"

_HOMES = {"dump": "library", "load": "library", "presets": "library", "Frame": "renderer", "Renderer": "renderer"}

__all__ = [
    "Camera",
    "FlatGround",
    "Frame",
    "Grass",
    "GreenswardError",
    "Gusts",
    "HeightMapGround",
    "InputError",
    "NoiseGround",
    "Post",
    "Renderer",
    "Scene",
    "SceneError",
    "Shadows",
    "Sky",
    "Solid",
    "Sowing",
    "Sun",
    "TechniqueChoice",
    "dump",
    "load",
    "presets",
]


def __getattr__(name: str) -> Any:
    # the command line answers --help without waiting for NumPy and OpenGL to load
    if name not in __all__:
        raise AttributeError(f"module 'greensward' has no attribute {name!r}")
    return getattr(import_module(f"greensward.{_HOMES.get(name, 'scene')}"), name)
