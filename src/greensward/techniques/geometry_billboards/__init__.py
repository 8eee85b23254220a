"""Billboards of single blades, made by the geometry stage from a pattern of roots, and flat tiles beyond them."""

from typing import Any, ClassVar

import moderngl
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from greensward.culling import distance_defines
from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device
from greensward.gpu.kernels import Bindings, Draw, Mesh
from greensward.gpu.layouts import BlockBuffer
from greensward.gpu.view import View
from greensward.motion import motion_defines
from greensward.scene import Scene
from greensward.sowing import sward_defines
from greensward.sowing.growth import GROWTH_BLOCK, curve_rows, phase_at
from greensward.sowing.identity import Ids
from greensward.sowing.pattern import pattern_of
from greensward.techniques.blades.leaf import LEAF_BLOCK
from greensward.techniques.geometry_billboards.pictures import Pictures, outline_of
from greensward.techniques.geometry_billboards.settings import BillboardSettings
from greensward.techniques.geometry_billboards.tiles import LEVELS, Tiles, levels_of, rings_of, tile_edge_m
from greensward.techniques.technique import Needs
from greensward.world import FrameTime, World

_FOLDER = "techniques/geometry_billboards"
_BLADE = [f"{_FOLDER}/blade.{stage}" for stage in ("vert", "geom", "frag")]
_FLAT = [f"{_FOLDER}/flat.{stage}" for stage in ("vert", "frag")]
_OF_A_TILE = "2i4 2f4 1f4 1u4 4f4 4f4/i", "tile", "corner_m", "edge_m", "number", "first", "second"


class GeometryBillboards:
    """A vertex for each root of each tile in view, from which the geometry stage makes a billboard."""

    name: ClassVar[str] = "geometry-billboards"
    source: ClassVar[str] = "Derstroff 2024, Real-time grass rendering"
    Settings: ClassVar[type[BaseModel]] = BillboardSettings

    def __init__(self, device: Device, world: World, settings: BillboardSettings) -> None:
        self._device, self._world, self._settings = device, world, settings
        self._parts: list[Any] = []
        self._tiles: Tiles | None = None
        scene = world.scene
        if not (_grows(scene) and world.ground.heights.exists):
            return
        self._tiles = Tiles(device, world, settings)
        self._leaf, self._growth = (BlockBuffer(device.ctx, block) for block in (LEAF_BLOCK, GROWTH_BLOCK))
        self._leaf.set(roundness=0.55)
        if scene.growth:
            self._growth.set(keys=curve_rows(scene.growth), spread=scene.growth.spread)
        pictures = Pictures(device.ctx, scene, settings)
        pattern = pattern_of(settings.roots, scene.seed)
        self._roots = device.ctx.buffer(np.stack([pattern["x"], pattern["z"]], -1))
        bindings = world.bindings
        bindings |= {**pictures.bindings, "Leaf": self._leaf, "Growth": self._growth}
        self._blades = {purpose: self._blade_draw(bindings, purpose) for purpose in ("picture", "shadow")}
        mesh = Mesh(((self._tiles.buffer, *_OF_A_TILE),))
        self._flat = Draw(
            device,
            *_FLAT,
            defines={**distance_defines(scene.culling), **sward_defines(scene)},
            bindings=bindings,
            meshes=[mesh],
        )
        self._flat.set(tile_m=tile_edge_m(scene, settings), tile_painted=settings.tile_texture is not None)
        for draw in self._blades.values():
            draw.set(**self._uniforms(scene), painted=pictures.painted)
        self._parts += [*self._blades.values(), self._flat, self._tiles, pictures]
        self._parts += [self._roots, self._leaf, self._growth]

    @staticmethod
    def check(scene: Scene, settings: BillboardSettings) -> None:
        """Refuse outlines of which nothing would be drawn."""
        outline_of(scene, settings)

    @staticmethod
    def needs(settings: BillboardSettings) -> Needs:  # noqa: ARG004
        """No blades: they follow from the pattern."""
        return Needs(stored=False)

    def _blade_draw(self, bindings: Bindings, purpose: str) -> Draw:
        assert self._tiles
        scene, settings = self._world.scene, self._settings
        defines = {**distance_defines(scene.culling), **motion_defines(scene), **sward_defines(scene)}
        defines["VERTICES"] = 2 * max(settings.segments) + 2
        flags = {
            "SHADOW": purpose == "shadow",
            "TUBE": settings.tube and purpose == "picture",
            "GROWTH": scene.growth is not None,
        }
        defines |= {name: 1 for name, flag in flags.items() if flag}
        mesh = Mesh(((self._roots, "2f4", "place"), (self._tiles.buffer, *_OF_A_TILE)))
        return Draw(self._device, *_BLADE, defines=defines, bindings=bindings, meshes=[mesh])

    def _uniforms(self, scene: Scene) -> dict[str, object]:
        settings = self._settings
        last, nothing_follows = levels_of(scene, settings)[2], len(rings_of(scene, settings)) == 1
        return {
            "roots": settings.roots,
            "thresholds": (settings.alpha, settings.beta),
            # the reach has a fading of its own
            "fade_m": (2.0 * last, 3.0 * last) if nothing_follows else ((1.0 - settings.fade) * last, last),
            "lean": settings.lean,
            "min_width_px": settings.min_width_px,
            "opacity": settings.opacity,
        }

    def update(self, frame: FrameTime) -> None:
        """Note the time, and how old the grass is then."""
        self._frame = frame
        growth = self._world.scene.growth
        if growth and self._tiles:
            self._growth.set(phase=phase_at(growth, frame.time_s))

    def draw(self, view: View) -> None:
        """List the tiles that the view shows, and draw them level by level."""
        tiles = self._tiles
        if tiles is None or (view.purpose == "shadow" and view.density == 0.0):
            return
        tiles.list_for(view)
        at = view.anchor_ws[[0, 2]] / tile_edge_m(self._world.scene, self._settings)
        anchor = {"anchor_tile": np.floor(at).astype(np.int32), "in_tile": at - np.floor(at)}
        for level, segments in enumerate(self._settings.segments):
            self._blades[view.purpose].run_indirect(
                moderngl.POINTS,
                tiles.commands,
                level,
                segments=segments,
                **anchor,
                time_s=self._frame.time_s,
                previous_time_s=self._frame.previous_time_s,
            )
        if view.purpose == "picture":
            self._flat.run_indirect(moderngl.TRIANGLE_STRIP, tiles.commands, LEVELS - 1)

    def identify(self, numbers: npt.NDArray[np.uint32]) -> Ids:
        """Find the permanent ids of roots and flat tiles by their numbers in the view that was listed last."""
        return self._tiles.identify(numbers) if self._tiles else np.zeros(len(numbers), np.uint64)

    def considered(self, view: View) -> int:  # noqa: ARG002
        """Count the roots and flat tiles around the camera, which are handed to the tests of every view."""
        return self._tiles.considered if self._tiles else 0

    def drawn(self, view: View) -> int:
        """Count the roots, whether a blade grows there or not, and flat tiles of this view in the last frame."""
        return self._tiles.drawn() if self._tiles and self._tiles.view is view else 0

    def release(self) -> None:
        """Free programs, textures and buffers."""
        release_all(*self._parts)
        self._parts.clear()


def _grows(scene: Scene) -> bool:
    return scene.sowing.density_per_m2 > 0.0 and sum(grass.share for grass in scene.grass) > 0.0
