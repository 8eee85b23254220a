"""WHAT is drawn: frozen models, TOML in and out, presets. Imports no GPU code."""

from greensward.scene.errors import GreenswardError, InputError, SceneError
from greensward.scene.field import Gusts, Shadows, Solid, Sowing, TechniqueChoice
from greensward.scene.grass import Grass
from greensward.scene.ground import FlatGround, HeightMapGround, NoiseGround
from greensward.scene.light import Camera, Post, Sky, Sun
from greensward.scene.scene import Scene

__all__ = [
    "Camera",
    "FlatGround",
    "Grass",
    "GreenswardError",
    "Gusts",
    "HeightMapGround",
    "InputError",
    "NoiseGround",
    "Post",
    "Scene",
    "SceneError",
    "Shadows",
    "Sky",
    "Solid",
    "Sowing",
    "Sun",
    "TechniqueChoice",
]
