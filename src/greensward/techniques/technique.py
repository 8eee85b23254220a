"""Contract that every technique keeps."""

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.gpu.device import Device
from greensward.gpu.view import View
from greensward.scene import Scene
from greensward.sowing.identity import Ids
from greensward.world import FrameTime, World

SettingsType = TypeVar("SettingsType", bound=BaseModel, contravariant=True)


@dataclass(frozen=True)
class Needs:
    """Demands of a technique on the world and on the order of a frame."""

    stored: bool = True
    """It draws the blades that the world sows and stores; if not, none are sown."""
    unstored: bool = False
    """It also draws pages whose blades its shaders must grow."""
    on_ground: bool = True
    """True if it draws stored blades of the ground too; if not, only those of objects are sown."""
    density: float = 1.0
    """Factor on `sowing.density_per_m2` of what is sown, of which it leaves some out."""
    beside: float = 0.0
    """Distance at which it draws others beside a stored blade, in mean distances between blades."""
    thinning: float = 0.0
    """Part of the blades that it leaves out at `sowing.reach_m`; less nearer, in proportion to distance. The ground
    takes on what they would have shown."""
    shrinking: float = 0.0
    """Part of their height that it leaves out there, likewise."""
    all_else_first: bool = False
    """All else must be in a picture before it."""


class Technique(Protocol[SettingsType]):
    """One way of drawing a field of grass into the G-buffer."""

    name: ClassVar[str]
    """Name in scene files and on the command line; also the folder and the docs page."""
    source: ClassVar[str]
    """Author, year, title."""
    Settings: ClassVar[type[BaseModel]]
    """This technique's own parameters: a frozen model."""

    @staticmethod
    def needs(settings: SettingsType) -> Needs:
        """Demands of the technique with these settings."""

    @staticmethod
    def check(scene: Scene, settings: SettingsType) -> None:
        """Raise `InputError` where these settings do not fit the scene."""

    def __init__(self, device: Device, world: World, settings: SettingsType) -> None:
        """Build every GPU resource."""

    def update(self, frame: FrameTime) -> None:
        """Do the compute work for this frame; most techniques have none."""

    def draw(self, view: View) -> None:
        """Draw into the bound framebuffer; no GL state is left changed.

        A picture's ground and objects may already be in it; before its first sample they are, and
        `world.depth_pyramid` has what they hide, if the scene asks for that. `world.bindings` has the view, and of
        a picture the G-buffer to read and, where passes run in compute shaders, to write as shaders/emit.glsl
        declares it. A test that `scene.culling` switches off leaves out nothing.
        """

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of blades by their numbers in the last picture: uint64 (n,).

        A blade has the same id in every frame, from every camera and in every process. Waits for the GPU.
        """

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""

    def drawn(self, view: View) -> int:
        """Count the blades of this view that its tests left to be drawn in the last frame. Waits for the GPU."""

    def release(self) -> None:
        """Free every GPU resource."""
