"""Models of a scene: frozen, with TOML in and out and presets. Imports no GPU code."""

from greensward.scene.classes import SurfaceClass
from greensward.scene.clearing import Clearing
from greensward.scene.colour import ChannelNoise, GroundColour, NoiseColour
from greensward.scene.errors import GreenswardError, InputError, SceneError
from greensward.scene.fence import Fence
from greensward.scene.field import Culling, Growth, Shadows, Sowing, TechniqueChoice
from greensward.scene.flowers import Flowers
from greensward.scene.force import Footprints, ForceMap, Stamp, Tracks
from greensward.scene.grass import Grass
from greensward.scene.ground import EndlessGround, FlatGround, HeightMapGround, NoGround, NoiseGround
from greensward.scene.light import Camera, Fog, Phong, Post, Sky, Sun
from greensward.scene.objects import Box, Capsule, Cylinder, Fur, Mesh, Path, Sphere
from greensward.scene.scene import Scene
from greensward.scene.water import Water
from greensward.scene.wind import (
    Blast,
    Gusts,
    Helicopter,
    Idle,
    Mass,
    Random,
    Ripples,
    Simulation,
    Strong,
    Texture,
    Wake,
    Waves,
    Whirl,
)

__all__ = [
    "Blast",
    "Box",
    "Camera",
    "Capsule",
    "ChannelNoise",
    "Clearing",
    "Culling",
    "Cylinder",
    "EndlessGround",
    "Fence",
    "FlatGround",
    "Flowers",
    "Fog",
    "Footprints",
    "ForceMap",
    "Fur",
    "Grass",
    "GreenswardError",
    "GroundColour",
    "Growth",
    "Gusts",
    "HeightMapGround",
    "Helicopter",
    "Idle",
    "InputError",
    "Mass",
    "Mesh",
    "NoGround",
    "NoiseColour",
    "NoiseGround",
    "Path",
    "Phong",
    "Post",
    "Random",
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
    "SurfaceClass",
    "TechniqueChoice",
    "Texture",
    "Tracks",
    "Wake",
    "Water",
    "Waves",
    "Whirl",
]
