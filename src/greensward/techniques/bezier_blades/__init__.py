"""Quadratic Bézier blades as tessellated quads."""

from dataclasses import dataclass
from typing import ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.culling import CHUNK, BladeCulling, DrawList, distance_defines
from greensward.gpu.buffers import BufferRange, at_least, release_all
from greensward.gpu.device import STORAGE_WRITTEN, Device
from greensward.gpu.kernels import Draw, Kernel
from greensward.gpu.layouts import BlockBuffer, struct
from greensward.gpu.view import View
from greensward.scene import Scene
from greensward.sowing import sward_defines
from greensward.sowing.identity import Ids
from greensward.techniques.blades.leaf import LEAF_BLOCK, LeafSettings
from greensward.techniques.technique import Needs
from greensward.world import FrameTime, World

_FOLDER = "techniques/bezier_blades"
# what the pipeline's stages need of a blade that is drawn
_RECORD = struct(
    "BladeRecord",
    ("x", "float"),  # root in relative space, metres
    ("y", "float"),
    ("z", "float"),
    ("width", "float"),  # metres, as drawn
    ("now", "uint", 3),  # control point and tip from the root, as in Pose
    ("side", "uint"),  # octahedral, as drawn: turned to the viewer where the blade would vanish
    ("previous", "uint", 3),  # one frame ago
    ("true_side", "uint"),  # octahedral, for the shading normal
    ("root_colour", "uint"),  # square root of the colour; transmittance
    ("tip_colour", "uint"),  # square root of the colour; roughness
    ("shading", "uint"),  # height over four times the canopy's, 0 near to 1 far; share of the area drawn
    ("wall", "uint"),  # octahedral, the shading normal of far blades
    ("blade", "uint"),  # index within its page
    ("level_and_shape", "uint"),  # segments, 0 where nothing is drawn; shape
)


class BezierSettings(LeafSettings):
    """Fineness, thinness and roundness of blades."""


@dataclass(frozen=True)
class _Part:
    """Records of what a view shows of a page, and the number of the command that draws them."""

    shown: DrawList
    records: BufferRange
    command: int


def _room(shown: DrawList) -> int:
    """Bytes for records of all its blades, in whole instances, which is aligned as bindings must be."""
    return -(-shown.blades.items // CHUNK) * CHUNK * _RECORD.dtype.itemsize


class BezierBlades:
    """One patch per blade: culled, levelled and widened in a compute stage, curved in the evaluation stage."""

    name: ClassVar[str] = "bezier-blades"
    source: ClassVar[str] = (
        "Jahrmann & Wimmer 2017, Responsive Real-Time Grass Rendering for General 3D Scenes; "
        "Yan, Wu & Wang 2024, Enhanced Real-Time Grass Rendering"
    )
    Settings: ClassVar[type[BaseModel]] = BezierSettings

    def __init__(self, device: Device, world: World, settings: BezierSettings) -> None:
        self._device, self._world = device, world
        self._block = BlockBuffer(device.ctx, LEAF_BLOCK)
        self._block.set(**settings.block_values())
        bindings = world.bindings
        bindings["Leaf"] = self._block
        tests, occlusion = world.scene.culling, world.depth_pyramid is not None
        self._culling = BladeCulling(device, bindings, tests, "techniques/blades/width.glsl", occlusion)
        stages = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "tesc", "tese", "frag")]
        colours = sward_defines(world.scene)
        self._prepare: dict[str, Kernel] = {}
        self._draws: dict[str, Draw] = {}
        for purpose, defines in (("picture", {}), ("shadow", {"SHADOW": 1})):
            self._prepare[purpose] = Kernel(
                device, f"{_FOLDER}/prepare.comp", {**distance_defines(tests), **colours, **defines}, bindings
            )
            self._draws[purpose] = Draw(device, *stages, defines=defines, bindings=bindings)
        self._records = device.ctx.buffer(reserve=_RECORD.dtype.itemsize)
        self._prepared: dict[View, list[_Part]] = {}

    @staticmethod
    def check(scene: Scene, settings: BezierSettings) -> None:
        """Accept any scene."""

    @staticmethod
    def needs(settings: BezierSettings) -> Needs:  # noqa: ARG004
        """Stored blades."""
        return Needs()

    def update(self, frame: FrameTime) -> None:
        """Make room for a record of every blade that some view may show; `draw` fills it once per view."""
        self._prepared.clear()
        self._used = self._commands = 0
        shown = [each for view in frame.views for each in self._world.visible.of(view)]
        self._records = at_least(self._device, self._records, sum(map(_room, shown)))
        self._culling.make_room(len(shown), max((each.blades.count for each in shown), default=0))

    def draw(self, view: View) -> None:
        """Draw every blade that the view shows."""
        if view not in self._prepared:
            self._prepared[view] = [self._fill(shown, view) for shown in self._world.visible.of(view)]
        self._device.ctx.patch_vertices = 1
        commands = self._culling.commands
        for part in self._prepared[view]:
            page = part.shown.page
            self._draws[view.purpose].run_indirect(
                moderngl.PATCHES,
                commands,
                part.command,
                Records=part.records,
                Commands=commands,
                command=part.command,
                first_blade_number=page.first_number,
                previous_from_now=view.relative(page.previous_from_now),
            )

    def _fill(self, shown: DrawList, view: View) -> _Part:
        """Decide about every blade in compute shaders, which run on all cores; the stages only look up."""
        part = _Part(shown, BufferRange(self._records, self._used, _room(shown)), self._commands)
        self._used += part.records.size
        self._commands += 1
        page, blades, chunks = shown.page, shown.blades, self._world.visible.chunks
        self._culling.cull(page, blades, chunks, view, part.command)
        self._prepare[view.purpose].run(
            blades.groups,
            **page.bindings,
            **self._culling.compacted,
            Chunks=chunks.buffer,
            Records=part.records,
            first_chunk=blades.first,
            chunk_count=blades.count,
            on_ground=page.object_index is None,
        )
        self._device.ctx.memory_barrier(STORAGE_WRITTEN)
        return part

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of stored blades by their numbers."""
        return self._world.field.identify(numbers)

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""
        return self._world.visible.considered(view)

    def drawn(self, view: View) -> int:
        """Count the blades that were drawn of this view in the last frame."""
        parts = self._prepared.get(view, ())
        survivors = self._culling.survivors() if parts else ()
        return sum(int(survivors[part.command]) for part in parts)

    def release(self) -> None:
        """Free programs, blocks and records."""
        release_all(*self._prepare.values(), *self._draws.values(), self._block, self._records, self._culling)
