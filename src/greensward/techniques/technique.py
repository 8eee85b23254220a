"""The contract that every technique keeps."""

from typing import ClassVar, Protocol

import moderngl
from pydantic import BaseModel

from greensward.gpu.view import View
from greensward.world import Instant, World


class Technique(Protocol):
    """One way of drawing a field of grass into the G-buffer."""

    name: ClassVar[str]
    """What a scene file and the command line call it; also the folder and the docs page."""
    source: ClassVar[str]
    """Author, year, title."""
    Settings: ClassVar[type[BaseModel]]
    """This technique's own parameters: a frozen model."""
    last: ClassVar[bool]
    """Whether all else must be in a picture before it."""
    draws_unstored: ClassVar[bool]
    """Whether it takes pages whose blades its shaders must grow."""

    @staticmethod
    def draws_field(settings: BaseModel) -> bool:
        """Whether it draws the blades that the world sows, with these settings; if not, none are sown."""

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel) -> None:
        """Build every GPU resource."""

    def update(self, instant: Instant) -> None:
        """Compute work for this instant; most techniques have none."""

    def draw(self, view: View) -> None:
        """Draw calls into the bound framebuffer; no GL state is left changed.

        A picture's ground and objects may already be in it; before its first sample they are, and `world.pyramid`
        tells what they hide, if the scene asks for that. Its classes and ids are at texture unit 13, its linear depth
        at 14, and where passes run in compute shaders its images are bound as shaders/emit.glsl declares them. A test
        that `scene.culling` switches off leaves out nothing.
        """

    def considered(self, view: View) -> int:
        """Blades of this view that were handed to its tests in the last frame."""

    def drawn(self, view: View) -> int:
        """Blades of this view that its tests left to be drawn in the last frame. Waits for the GPU."""

    def release(self) -> None:
        """Free every GPU resource."""
