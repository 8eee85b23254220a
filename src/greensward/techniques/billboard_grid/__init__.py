"""Ray-marched billboards: grass as a grid of textured billboards that rays are followed through, below the tips."""

import math
from typing import Any, ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.gpu.buffers import at_least, read_back
from greensward.gpu.device import IMAGES_WRITTEN, Device
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Draw, Kernel, Resource
from greensward.gpu.view import View
from greensward.ground.rays import MaximumMipmap
from greensward.motion import motion_defines
from greensward.scene import InputError, Scene
from greensward.scene.base import linear
from greensward.sowing import sward_defines
from greensward.sowing.blade import FIRST_TRACED
from greensward.sowing.identity import Ids
from greensward.sowing.pages import ID_BYTES
from greensward.techniques.billboard_grid.pictures import Billboards, mean_length_m
from greensward.techniques.billboard_grid.settings import GridSettings
from greensward.techniques.technique import Needs
from greensward.world import FrameTime, World

_FOLDER = "techniques/billboard_grid"
_FARTHEST_M = 1e6
_COARSER = 2
"""Texels of a shadow map across that one ray from the sun stands for; the map's filter is as wide."""


class BillboardGrid:
    """One pass over the picture: every ray enters the grass at its tips, and ends where it has become opaque.

    With `far` it begins where a technique that draws blades leaves off, as `sowing.traced_m` says.
    """

    name: ClassVar[str] = "billboard-grid"
    source: ClassVar[str] = "Habel, Wimmer & Jeschke 2007, Instant Animated Grass"
    Settings: ClassVar[type[BaseModel]] = GridSettings

    def __init__(self, device: Device, world: World, settings: GridSettings, *, far: bool = False) -> None:
        self._device, self._world = device, world
        scene = world.scene
        self._spacing_m = settings.spacing * mean_length_m(scene)
        self._billboard_m = settings.billboard_m
        self._turn = math.cos(math.radians(settings.turn_deg)), math.sin(math.radians(settings.turn_deg))
        self._mipmap: MaximumMipmap | None = None
        self._billboards: Billboards | None = None
        self._shadow: _Shadow | None = None
        self._ids = device.ctx.buffer(reserve=ID_BYTES)
        """Permanent id of what each pixel shows."""
        self._trace: Kernel | Draw | None = None
        material = _mean_material(scene)
        heights = world.ground.heights
        if material is None or not heights.exists or scene.sowing.density_per_m2 == 0.0:
            return
        self._billboards = Billboards(device, scene, settings)
        self._mipmap = MaximumMipmap(device, heights)
        defines = {**motion_defines(scene), **sward_defines(scene)}
        for name, flag in (
            ("FAR", far),
            ("MIDDLE_PLANE", settings.middle_plane),
            ("EARLY_EXIT", settings.early_exit),
            ("FILL_COLOUR", settings.fill == "colour"),
            ("SHEAR", settings.sway == "shear"),
            ("LEVEL", heights.lowest_m == heights.highest_m),
            ("MAPPED", scene.sowing.density_map is not None),
        ):
            if flag:
                defines[name] = 1
        bindings: dict[str, Resource] = {**self._billboards.bindings, "Highest": self._mipmap.buffer}
        world.bindings.update(bindings)
        carried = {**defines, "CARRIER": 1} if settings.carrier else defines
        if world.stage == "compute":
            self._trace = Kernel(device, f"{_FOLDER}/trace.comp", carried, world.bindings)
        else:
            stages = "shaders/screen.vert", f"{_FOLDER}/trace.frag"
            self._trace = Draw(device, *stages, defines=carried, bindings=world.bindings)
        if not far:
            self._shadow = _Shadow(device, world, defines)
        for shader in (self._trace, self._shadow.rays.shader) if self._shadow else (self._trace,):
            self._mipmap.describe(shader)
            shader.set(
                turn=self._turn,
                spacing_m=self._spacing_m,
                irregular=settings.irregularity,
                billboard_m=self._billboard_m,
                tall_m=self._billboards.tall_m,
                layer_m=self._billboards.tall_m * (1.0 + 0.45 * scene.sowing.drift),
                steps=settings.steps,
                layers=self._billboards.layers,
                opacity=settings.opacity,
                mean_material=material[:4],
                mean_blade=material[4:],
            )

    @staticmethod
    def check(scene: Scene, settings: GridSettings) -> None:
        """Refuse growth, and billboards that are nearer to each other than their texels are wide."""
        if scene.growth:
            raise InputError(
                "technique.name: must not be billboard-grid with [growth], as its billboards are full-grown"
            )
        texel_m, spacing_m = settings.billboard_m / settings.texture_px, settings.spacing * mean_length_m(scene)
        if spacing_m < texel_m:
            raise InputError(
                f"technique.spacing: must be at least a texel of the billboards, {texel_m * 1000:.3g} mm "
                f"(got {settings.spacing:g} blade lengths, {spacing_m * 1000:.3g} mm); "
                "raise spacing or technique.texture_px, or lower technique.billboard_m"
            )

    @staticmethod
    def needs(settings: GridSettings) -> Needs:  # noqa: ARG004
        """No blades: its billboards bear blades of their own. Rays end at all that is drawn before."""
        return Needs(stored=False, all_else_first=True)

    def update(self, frame: FrameTime) -> None:
        """Note the time."""
        self._frame = frame

    def draw(self, view: View) -> None:
        """Follow a ray through every pixel of the view."""
        if not (self._billboards and self._trace):
            return
        casting = self._shadow if view.purpose == "shadow" else None
        if view.purpose == "shadow" and (casting is None or view.density == 0.0):
            return
        at = np.array([[self._turn[0], self._turn[1]], [-self._turn[1], self._turn[0]]]) @ view.origin_ws[[0, 2]]
        cell, billboard = np.floor(at / self._spacing_m), np.floor(at / self._billboard_m)
        values: dict[str, Any] = {
            "first_cell": tuple(int(edge) for edge in cell),
            "in_cell_m": tuple(at - cell * self._spacing_m),
            "first_billboard": tuple(int(edge) for edge in billboard),
            "in_billboard": tuple(at / self._billboard_m - billboard),
            "time_s": self._frame.time_s,
            "previous_time_s": self._frame.previous_time_s,
        }
        if casting:
            relative_from_clip = np.linalg.inv(view.clip_from_world @ view.world_from_relative)
            casting.draw(view.size_px, **values, range_m=(0.0, _FARTHEST_M), relative_from_clip=relative_from_clip)
            return
        if view.size_px[0] * view.size_px[1] > FIRST_TRACED:
            raise InputError(f"size: a picture of traced grass has at most {FIRST_TRACED:,} pixels")
        self._ids = at_least(self._device, self._ids, ID_BYTES * view.size_px[0] * view.size_px[1], ID_BYTES)
        values |= {"range_m": view.near_and_far_m, "TracedIds": self._ids}
        if isinstance(self._trace, Kernel):
            self._trace.run_over(view.size_px, **values)
            self._device.ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            self._device.ctx.enable_only(moderngl.NOTHING)
            self._trace.run(moderngl.TRIANGLES, 3, **values)

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Look up the ids, which the rays have left for each pixel; a number is that of a pixel."""
        ids: Ids = np.frombuffer(read_back(self._device, self._ids), np.uint64)[numbers - FIRST_TRACED]
        return ids

    def considered(self, view: View) -> int:  # noqa: ARG002
        """Count none: it has no blades that could be tested."""
        return 0

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Count none."""
        return 0

    def release(self) -> None:
        """Free textures and programs."""
        for part in (self._billboards, self._mipmap, self._trace, self._shadow, self._ids):
            if part:
                part.release()


class _Shadow:
    """Follows the sun's rays, and leaves their depth in a shadow map.

    Shaders cannot write to depth textures but as fragments, in which rays are slow on GPUs.
    """

    def __init__(self, device: Device, world: World, defines: dict[str, object]) -> None:
        self._ctx = device.ctx
        self._traced: moderngl.Texture | None = None
        coarser = {"COARSER": _COARSER}
        self.rays = FullScreenPass(
            device,
            f"{_FOLDER}/shadow.glsl",
            ["f4"],
            stage=world.stage,
            defines={**defines, **coarser, "SHADOW": 1},
            bindings=world.bindings,
        )
        self._copy = Draw(device, "shaders/screen.vert", f"{_FOLDER}/shadow.frag", defines=coarser)

    def draw(self, size_px: tuple[int, int], **values: Any) -> None:
        """Draw into the current framebuffer, which is of this size, behind what it holds."""
        target, traced = self._ctx.fbo, self._traced_for(size_px)
        self.rays.run(traced, **values)
        target.use()
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        self._copy.run(moderngl.TRIANGLES, 3, traced=traced)

    def _traced_for(self, size_px: tuple[int, int]) -> moderngl.Texture:
        """Image that rays leave their depth in; another where shadow maps have another size than the last."""
        size = -(-size_px[0] // _COARSER), -(-size_px[1] // _COARSER)
        if self._traced is None or self._traced.size != size:
            if self._traced:
                self._traced.release()
            self._traced = self._ctx.texture(size, 4, dtype="f4")
        return self._traced

    def release(self) -> None:
        """Free the GPU resources."""
        self.rays.release()
        self._copy.release()
        if self._traced:
            self._traced.release()


def _mean_material(scene: Scene) -> tuple[float, ...] | None:
    """Colour as `swardColour` of sowing/sward.glsl has it without drifts, transmittance, stiffness and roughness."""
    weights, looks = [], []
    for grass in scene.grass:
        weights.append(grass.share * sum(grass.height_m) * sum(grass.width_m))
        root, tip, dry = (
            np.array(linear(colour)) for colour in (grass.root_colour, grass.tip_colour, grass.dry_colour)
        )
        green = 0.1 * root + 0.9 * tip
        if grass.head != "none":
            green += 0.5 * grass.head_share * (np.array(linear(grass.head_colour)) - green)
        green += sum(grass.dryness) / 2.0 * (dry - green)
        looks.append([*green, grass.transmittance, sum(grass.stiffness) / 2.0, grass.roughness])
    if not sum(weights):
        return None
    return tuple(float(value) for value in np.average(looks, axis=0, weights=weights))
