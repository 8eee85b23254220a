"""Stored roots that the geometry stage expands into blades, from a vertex buffer or from textures."""

import math
from dataclasses import dataclass
from operator import is_not
from typing import ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.culling import DRAW_COMMAND, DrawList, distance_to, test_defines
from greensward.gpu.buffers import at_least, clear, read_back, release_all, upload, zeros
from greensward.gpu.device import Device
from greensward.gpu.kernels import Draw, Mesh
from greensward.gpu.layouts import WORD, BlockBuffer
from greensward.gpu.view import View
from greensward.scene import InputError, Scene
from greensward.sowing import Page, sward_defines
from greensward.sowing.identity import Ids, beside
from greensward.techniques.blades.leaf import LEAF_BLOCK
from greensward.techniques.expanded_roots.settings import RootSettings
from greensward.techniques.expanded_roots.textures import RootTextures
from greensward.techniques.technique import Needs
from greensward.world import FrameTime, World

_FOLDER = "techniques/expanded_roots"
_STAGES = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "geom", "frag")]
# the fields of `Blade` in order
_ROOT = "4u4 4u4 4u4 4u4", "place", "control", "tip", "habit"
_DRAWN_PARTS = 1024


@dataclass(frozen=True)
class _Part:
    """Roots of a page that a view may show: consecutive draw commands, one for each tile."""

    page: Page
    first: int
    count: int


class ExpandedRoots:
    """A vertex for each root, in a draw for each tile in view; the geometry stage makes its blades."""

    name: ClassVar[str] = "expanded-roots"
    source: ClassVar[str] = "Tillman 2013, bachelor thesis, Blekinge Institute of Technology"
    Settings: ClassVar[type[BaseModel]] = RootSettings

    def __init__(self, device: Device, world: World, settings: RootSettings) -> None:
        self._device, self._world, self._settings = device, world, settings
        self._leaf = BlockBuffer(device.ctx, LEAF_BLOCK)
        self._leaf.set(**settings.block_values())
        world.bindings["Leaf"] = self._leaf
        textures = settings.storage == "texture-array"
        self._textures = RootTextures(device, world, settings.extra_blades > 0) if textures else None
        self._drawn = zeros(device, _DRAWN_PARTS * WORD)
        self._commands = device.ctx.buffer(reserve=DRAW_COMMAND.dtype.itemsize)
        self._pages: list[Page] = []
        self._draws: dict[str, Draw] = {}
        self._make_draws()
        self._shown: dict[View, object] = {}
        self._parts: dict[View, list[_Part]] = {}

    @staticmethod
    def check(scene: Scene, settings: RootSettings) -> None:
        """Accept any scene."""

    @staticmethod
    def needs(settings: RootSettings) -> Needs:
        """Stored blades: each is a root, with others beside it."""
        return Needs(beside=0.57 if settings.extra_blades else 0.0)

    def _make_draws(self) -> None:
        """Draws whose vertices are the roots of each page."""
        before, self._pages = self._draws, self._world.field.pages
        meshes = [Mesh()] if self._textures else [Mesh(((page.blades, *_ROOT),)) for page in self._pages]
        self._draws = {}
        for purpose in ("picture", "shadow"):
            draw = Draw(
                self._device, *_STAGES, defines=self._defines(purpose), bindings=self._world.bindings, meshes=meshes
            )
            draw.set(**self._uniforms())
            self._draws[purpose] = draw
        release_all(*before.values())

    def _defines(self, purpose: str) -> dict[str, object]:
        settings, world = self._settings, self._world
        blades = 1 + settings.extra_blades
        occluded = world.depth_pyramid is not None
        defines = {**test_defines(world.scene.culling, purpose, occluded), **sward_defines(world.scene)}
        own = settings.expansion == "invocations" and blades > 1
        if own:
            defines["INVOCATIONS"] = blades
        if self._textures:
            defines["TEXTURES"] = 1
        lines = settings.points[0] // 2 + 1
        return {
            **defines,
            "EXTRA": settings.extra_blades,
            "LINE": lines,
            "VERTICES": settings.points[0] * (1 if own else blades),
            # of the logarithm that a blade keeps of how many grow around it
            "CROWDED": f"{round(8.0 * math.log2(blades))}u",
        }

    def _uniforms(self) -> dict[str, object]:
        settings = self._settings
        return {
            "levels_m": settings.levels_m,
            "fade": settings.fade,
            "lines": tuple(count // 2 + 1 for count in settings.points),
            "broader": tuple(self._area(settings.points[0]) / self._area(count) for count in settings.points),
            "widths": (settings.root_width, settings.top_width),
            "launch": (settings.speed_mps, settings.gravity_mps2, settings.interval_s, settings.flight_s),
            "angles": tuple(map(math.radians, settings.angle_deg)),
            "intervals": settings.points[0] // 2,
            "numbers_of_each": self._most_roots,
        }

    @property
    def _most_roots(self) -> int:
        """Roots whose blades can all be numbered."""
        return self._world.field.most_blades // (1 + self._settings.extra_blades)

    def _area(self, points: int) -> float:
        """Area of an outline, of which length and species' width are 1."""
        below = np.linspace(self._settings.root_width, self._settings.top_width, points // 2)
        widths = np.append(below, 0.0)
        return max(float(0.5 * (widths[1:] + widths[:-1]).mean()), 1e-6)

    def update(self, frame: FrameTime) -> None:
        """Take over tiles that have come, and list those that each view may show if that has changed."""
        pages = self._world.field.pages
        if len(pages) != len(self._pages) or any(map(is_not, pages, self._pages)):
            self._refuse_numbers()
            self._make_draws()
        if self._textures:
            self._textures.update(frame)
        visible = self._world.visible
        shown = {view: visible.of(view) for view in frame.views}
        if shown.keys() != self._shown.keys() or any(map(is_not, shown.values(), self._shown.values())):
            self._shown = dict(shown)
            self._list(frame.views)

    def _refuse_numbers(self) -> None:
        most = self._most_roots
        roots = sum(page.capacity for page in self._world.field.pages)
        if roots > most:
            raise InputError(
                f"technique.extra_blades: must leave a number for each blade, of {most:,} roots at most "
                f"(got {roots:,}); lower it, sowing.density_per_m2 or sowing.reach_m"
            )

    def _list(self, views: tuple[View, ...]) -> None:
        """Write a draw command for each tile that a view may show and that the last level reaches."""
        self._parts, rows, at = {}, [], 0
        outer_m = self._settings.levels_m[2] if self._world.scene.culling.distance else math.inf
        for view in views:
            self._parts[view] = []
            for shown in self._world.visible.of(view):
                assert isinstance(shown.page, Page)
                commands = _commands(shown, shown.page, view, outer_m)
                self._parts[view].append(_Part(shown.page, at, len(commands)))
                rows.append(commands)
                at += len(commands)
        if at:
            itemsize = DRAW_COMMAND.dtype.itemsize
            self._commands = at_least(self._device, self._commands, at * itemsize, itemsize)
            upload(self._device, self._commands, np.concatenate(rows))

    def draw(self, view: View) -> None:
        """Draw the roots of every tile that the view shows."""
        if view.purpose == "picture":
            clear(self._device, self._drawn, self._drawn.size)
        textures = self._textures
        for part in self._parts.get(view, ()):
            if not part.count:
                continue
            page = part.page
            stored = {}
            if textures:
                texture = textures.of(page)
                stored = {"roots_texture": texture, "texture_width": texture.width}
            self._draws[view.purpose].run_indirect(
                moderngl.POINTS,
                self._commands,
                part.first,
                part.count,
                0 if textures else self._pages.index(page),
                **stored,
                Poses=page.poses,
                Drawn=self._drawn,
                first_blade_number=page.first_number,
                on_ground=page.object_index is None,
                spacing_m=self._spacing_m(page),
                previous_from_now=view.relative(page.previous_from_now),
            )

    def _spacing_m(self, page: Page) -> float:
        scene, density = self._world.scene, self._world.scene.sowing.density_per_m2
        if page.object_index is not None and (grass := scene.object[page.object_index].grass):
            density = grass.density_per_m2
        return 1.0 / math.sqrt(max(density, 1e-6))

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of the blades of stored roots by their numbers."""
        extra, root = np.divmod(numbers - 1, np.uint32(self._most_roots))
        return beside(self._world.field.identify(root + np.uint32(1)), extra)

    def considered(self, view: View) -> int:
        """Count the blades of this view that were handed to its tests in the last frame."""
        return (1 + self._settings.extra_blades) * self._world.visible.considered(view)

    def drawn(self, view: View) -> int:  # noqa: ARG002
        """Count the blades of the picture that were drawn in the last frame."""
        return int(np.frombuffer(read_back(self._device, self._drawn), np.uint32).sum())

    def release(self) -> None:
        """Free programs, textures and buffers."""
        release_all(*self._draws.values(), self._leaf, self._drawn, self._commands)
        if self._textures:
            self._textures.release()


def _commands(shown: DrawList, page: Page, view: View, outer_m: float) -> np.ndarray:
    """A draw command for each tile within a distance of the camera, the nearest first."""
    away = distance_to(page.tiles, view.camera_ws)[shown.tiles]
    near = away < outer_m
    commands = np.zeros(int(near.sum()), DRAW_COMMAND.dtype)
    commands["vertices"], commands["instances"] = shown.lengths[near], 1
    commands["first_vertex"] = page.tiles.start[shown.tiles[near]]
    return commands
