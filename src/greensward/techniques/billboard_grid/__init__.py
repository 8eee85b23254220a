"""Grass as a grid of textured billboards that rays are followed through, below the tips."""

import math
from typing import ClassVar

import moderngl
import numpy as np
from pydantic import BaseModel

from greensward.gpu.pixel_pass import IMAGES_WRITTEN, PixelPass, pixel_groups
from greensward.gpu.program import build, build_compute, put
from greensward.gpu.view import View
from greensward.ground.rays import GroundRays
from greensward.motion import motion_defines
from greensward.scene import InputError, Scene
from greensward.scene.base import linear
from greensward.techniques.billboard_grid.pictures import Billboards, mean_length_m
from greensward.techniques.billboard_grid.settings import Settings
from greensward.world import Instant, World

_FOLDER = "techniques/billboard_grid"
_UNIT = 23
_FARTHEST_M = 1e6
_COARSER = 2
"""Texels of a shadow map across that one ray from the sun stands for; the map's filter is as wide."""


class BillboardGrid:
    """One pass over the picture: every ray enters the grass at its tips, and ends where it has become opaque.

    With `far` it begins where a technique that draws blades leaves off, as `sowing.traced_m` says.
    """

    name: ClassVar[str] = "billboard-grid"
    source: ClassVar[str] = "Habel, Wimmer & Jeschke 2007, Instant Animated Grass"
    Settings: ClassVar[type[BaseModel]] = Settings
    last: ClassVar[bool] = True
    draws_unstored: ClassVar[bool] = False

    def __init__(self, ctx: moderngl.Context, world: World, settings: BaseModel, *, far: bool = False) -> None:
        assert isinstance(settings, Settings)
        self._ctx, self._world = ctx, world
        scene = world.scene
        self._spacing_m = settings.spacing * mean_length_m(scene)
        self._billboard_m = settings.billboard_m
        self._turn = math.cos(math.radians(settings.turn_deg)), math.sin(math.radians(settings.turn_deg))
        _refuse(scene, settings, self._spacing_m)
        self._rays = self._billboards = self._shadow = None
        self._trace: moderngl.ComputeShader | None = None
        self._screen: moderngl.VertexArray | None = None
        look = _mean_look(scene)
        if look is None or not world.ground.heights.there or scene.sowing.density_per_m2 == 0.0:
            return
        self._billboards = Billboards(ctx, scene, settings)
        self._rays = GroundRays(ctx, world.ground.heights)
        defines = motion_defines(scene)
        for name, flag in (
            ("FAR", far),
            ("MIDDLE_PLANE", settings.middle_plane),
            ("EARLY_EXIT", settings.early_exit),
            ("FILL_COLOUR", settings.fill == "colour"),
            ("LEVEL", world.ground.heights.lowest_m == world.ground.heights.highest_m),
            ("MAPPED", scene.sowing.density_map is not None),
        ):
            if flag:
                defines[name] = 1
        if world.shell == "compute":
            self._trace = build_compute(ctx, f"{_FOLDER}/trace.comp", defines)
        else:
            self._screen = ctx.vertex_array(
                build(ctx, "shaders/screen.vert", f"{_FOLDER}/trace.frag", defines=defines), []
            )
        if not far:
            self._shadow = _Shadow(ctx, world, defines)
        for shader in (self._shader, self._shadow.rays.shader) if self._shadow else (self._shader,):
            self._rays.prepare(shader)
            put(
                shader,
                turn=self._turn,
                spacing_m=self._spacing_m,
                irregular=settings.irregularity,
                billboard_m=self._billboard_m,
                tall_m=self._billboards.tall_m,
                layer_m=self._billboards.tall_m * (1.0 + 0.45 * scene.sowing.drift),
                steps=settings.steps,
                layers=self._billboards.layers,
                opacity=settings.opacity,
                meanLook=look[:4],
                meanBlade=look[4:],
            )

    @staticmethod
    def draws_field(settings: BaseModel) -> bool:  # noqa: ARG004
        """Never: its billboards bear blades of their own."""
        return False

    @property
    def _shader(self) -> moderngl.ComputeShader | moderngl.Program:
        if self._trace:
            return self._trace
        assert self._screen
        return self._screen.program

    def update(self, instant: Instant) -> None:
        """Note the time."""
        self._instant = instant

    def draw(self, view: View) -> None:
        """Follow a ray through every pixel of the view."""
        if not (self._billboards and self._rays):
            return
        casting = self._shadow if view.purpose == "shadow" else None
        if view.purpose == "shadow" and (casting is None or view.density == 0.0):
            return
        self._billboards.bind(_UNIT)
        shader = casting.rays.shader if casting else self._shader
        at = np.array([[self._turn[0], self._turn[1]], [-self._turn[1], self._turn[0]]]) @ view.origin_ws[[0, 2]]
        cell = np.floor(at / self._spacing_m)
        put(
            shader,
            firstCell=tuple(int(edge) for edge in cell),
            inCell_m=tuple(at - cell * self._spacing_m),
            inBillboard=tuple((at / self._billboard_m) % 1.0),
            timeNow=self._instant.time_s,
            timePrevious=self._instant.previous_time_s,
        )
        if casting:
            self._rays.bind(shader, (0.0, _FARTHEST_M))
            relative_from_clip = np.linalg.inv(view.clip_from_world @ view.world_from_relative)
            put(shader, relative_from_clip=tuple(relative_from_clip.T.ravel()))
            casting.draw(view.size_px)
            return
        self._rays.bind(shader, view.near_and_far_m)
        if self._trace:
            self._trace.run(*pixel_groups(view.size_px))
            self._ctx.memory_barrier(IMAGES_WRITTEN)
        else:
            assert self._screen
            self._ctx.enable_only(moderngl.NOTHING)
            self._screen.render(moderngl.TRIANGLES, vertices=3)

    def considered(self, view: View) -> int:  # noqa: ARG002
        """None: it has no blades that could be tested."""
        return 0

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """None."""
        return 0

    def release(self) -> None:
        """Free textures and programs."""
        for part in (self._billboards, self._rays, self._trace, self._shadow):
            if part:
                part.release()
        if self._screen:
            self._screen.program.release()
            self._screen.release()


class _Shadow:
    """Follows the sun's rays, and leaves their depth in a shadow map.

    Shaders cannot write to depth textures but as fragments, in which rays are slow on GPUs.
    """

    def __init__(self, ctx: moderngl.Context, world: World, defines: dict[str, object]) -> None:
        self._ctx = ctx
        self._traced: moderngl.Texture | None = None
        coarser = {"COARSER": _COARSER}
        self.rays = PixelPass(
            ctx, f"{_FOLDER}/shadow.glsl", ["f4"], shell=world.shell, defines={**defines, **coarser, "SHADOW": 1}
        )
        self._copy = ctx.vertex_array(
            build(ctx, "shaders/screen.vert", f"{_FOLDER}/shadow.frag", defines=coarser), []
        )

    def draw(self, size_px: tuple[int, int]) -> None:
        """Into the current framebuffer, which is of this size, behind what it holds."""
        target, traced = self._ctx.fbo, self._traced_for(size_px)
        self.rays.run(traced)
        target.use()
        traced.use(_UNIT)
        self._ctx.enable_only(moderngl.DEPTH_TEST)
        self._copy.render(moderngl.TRIANGLES, vertices=3)

    def _traced_for(self, size_px: tuple[int, int]) -> moderngl.Texture:
        """The image that rays leave their depth in; another where shadow maps have another size than the last."""
        size = -(-size_px[0] // _COARSER), -(-size_px[1] // _COARSER)
        if self._traced is None or self._traced.size != size:
            if self._traced:
                self._traced.release()
            self._traced = self._ctx.texture(size, 4, dtype="f4")
        return self._traced

    def release(self) -> None:
        self.rays.release()
        if self._traced:
            self._traced.release()
        self._copy.program.release()
        self._copy.release()


def _refuse(scene: Scene, settings: Settings, spacing_m: float) -> None:
    if scene.growth:
        raise InputError("technique.name: must not be billboard-grid with [growth], as its billboards are full-grown")
    texel_m = settings.billboard_m / settings.texture_px
    if spacing_m < texel_m:
        raise InputError(
            f"technique.spacing: must be at least a texel of the billboards, {texel_m * 1000:.3g} mm "
            f"(got {settings.spacing:g} blade lengths, {spacing_m * 1000:.3g} mm); "
            "raise spacing or technique.texture_px, or lower technique.billboard_m"
        )


def _mean_look(scene: Scene) -> tuple[float, ...] | None:
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
