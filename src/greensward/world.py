"""The scene on the GPU: ground, objects, field, visible set and motion; what a technique is given."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.culling import ChunkRange, DepthPyramid, VisibleSet
from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.kernels import Bindings
from greensward.gpu.view import View, anchor_near
from greensward.ground import HeightField
from greensward.ground.ground_gpu import GroundGpu
from greensward.motion import (
    BladeSimulation,
    Colliders,
    Forces,
    MotionStep,
    Poses,
    Stateful,
    Winds,
    absent_forces,
    same_kinds,
)
from greensward.objects.fences import all_objects
from greensward.objects.helicopter import helicopters
from greensward.objects.placing import Placed, Placing, Script
from greensward.scene import InputError, NoiseColour, Scene, Wake
from greensward.scene.objects import Object
from greensward.sowing import Clearings, Field, Page

Floats = npt.NDArray[np.float64]
# parts of `sowing.full_density_m`
_STEP, _COARSE_STEP = 0.006, 0.2


@dataclass(frozen=True)
class FrameTime:
    """Time of a frame and of the one before it, and every view that is drawn of it."""

    time_s: float
    previous_time_s: float
    views: tuple[View, ...]


class World:
    """Ground, field, objects and motion of a scene on one device.

    Without `sown` the field stays empty, for a technique that brings blades of its own; `beside` is how far from a
    blade of the field it draws others, in mean distances between blades. Without `on_ground` only objects are sown;
    `density` is a factor on the scene's. Full-screen passes run in `stage`.
    `bindings` takes what shaders of the frame share, by name.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        heights: HeightField,
        stage: Stage,
        bindings: Bindings,
        scripts: Mapping[str, Script] | None = None,
        sown: bool = True,
        beside: float = 0.0,
        on_ground: bool = True,
        density: float = 1.0,
    ) -> None:
        self.device = device
        self.scene = scene
        self.stage = stage
        self.bindings = bindings
        """Resources that shaders of a frame share, by name: ground, maps, sward, winds, forces, view, G-buffer."""
        self._sown, self._scripts = sown, dict(scripts or {})
        self.ground = GroundGpu(device, scene, heights)
        self._stand(scene)
        self._clearings = Clearings(device, scene, self.placing, self.objects, heights)
        self.field = Field(device, scene, self.ground, beside, self._clearings.bindings, on_ground, density)
        self._winds = Winds(device, scene, heights, self.placing.moving)
        self._forces = Forces(device, scene)
        bindings.update({**self.field.bindings, **self._winds.bindings, **self._forces.bindings})
        self._poses = Poses(device, scene, bindings)
        bindings.update(self._poses.bindings)
        self._colliders: Colliders | None = None
        self._simulation: BladeSimulation | None = None
        if scene.simulation:
            self._colliders = Colliders(device, self.objects, heights, scripts or {}, scene.resolve)
            bindings.update(self._colliders.bindings)
            self._simulation = BladeSimulation(device, scene, self.field, self._colliders, bindings)
        self._stateful: list[Stateful] = [
            *self._winds.stateful,  # first: blades are bent by them
            *([self._simulation] if self._simulation else []),
        ]
        self.depth_pyramid = DepthPyramid(device, bindings) if self._hides_grass(scene, self.objects) else None
        """Depth pyramid of what hides grass in the picture; None where nothing can, or the scene asks for none."""
        self.visible = VisibleSet(device, scene)
        self._analytic: list[tuple[Page, ChunkRange]] = []
        self._focus: Floats | None = None
        self._camera_ws: Floats | None = None
        self._anchor_ws = self._sown_from_ws = np.zeros(3)
        # unstored tiles are cheap to leave and dear to list
        self._step_m = scene.sowing.full_density_m * (_STEP if scene.sowing.stored_m is None else _COARSE_STEP)

    def _stand(self, scene: Scene) -> None:
        """Take up a scene's objects and where they are."""
        heights = self.ground.heights
        flying, flights = helicopters(scene.wind, heights)
        self.objects = all_objects(scene, heights) + flying
        """Objects of the scene, those of its fences, and those that belong to its winds."""
        names = {each.name for each in self.objects}
        # what a host places may be gone, and come again
        scripts = {
            name: each for name, each in self._scripts.items() if name in names or not isinstance(each, Placed)
        }
        self.placing = Placing(self.objects, heights, {**flights, **scripts})
        self.placed = self.previously_placed = self.placing.at(0.0)
        """World from own space of every object, now and a frame ago: float64 (objects, 4, 4)."""

    def script(self, name: str, script: Script) -> bool:
        """Let a script move an object from now on; return False where the field must be built anew for that."""
        moved = [each for each in self.scene.object if each.name == name]
        if not moved or not all(map(self._is_scenery, moved)) or self._stirred(self.scene):
            return False
        self._scripts[name] = script
        self._stand(self.scene)
        return True

    @property
    def has_meshes(self) -> bool:
        """True if a picture may show objects, flowers or seed heads, which have triangles."""
        heads = any(each.head != "none" for each in self.scene.grass)
        return heads or bool(self.scene.flowers) or any(each.drawn for each in self.objects)

    def _hides_grass(self, scene: Scene, objects: Sequence[Object]) -> bool:
        """Return whether hills or objects hide grass, and the scene wants to know."""
        heights = self.ground.heights
        hills = heights.exists and heights.highest_m > heights.lowest_m
        return scene.culling.occlusion and (hills or any(each.drawn for each in objects))

    def _same_but_scenery(self, scene: Scene) -> bool:
        """Return whether another scene's objects differ only in such as neither press, clear nor bear grass."""
        if scene.object == self.scene.object:
            return True
        before, after = (
            [(i if each.grass else 0, each) for i, each in enumerate(objects) if not self._is_scenery(each)]
            for objects in (self.scene.object, scene.object)
        )
        hide = {self._hides_grass(each, all_objects(each, self.ground.heights)) for each in (self.scene, scene)}
        return before == after and not self._stirred(scene) and len(hide) == 1

    @staticmethod
    def _stirred(scene: Scene) -> bool:
        """Return whether objects move the air."""
        return any(isinstance(wind, Wake) and wind.by != "camera" for wind in scene.wind)

    def _is_scenery(self, each: Object) -> bool:
        clears = each.clears and each.drawn and each.path is None and each.name not in self._scripts
        presses = each.collides and self._simulation is not None
        return not (each.grass or clears or presses)

    def follow(self, camera_ws: Floats) -> None:
        """Make the field around the camera resident, in steps of a grid: it depends on where the camera is alone."""
        cell, anchor_ws = np.floor(camera_ws / self._step_m), anchor_near(camera_ws)
        if not np.array_equal(anchor_ws, self._anchor_ws):
            self._focus = None
            self._count_from(anchor_ws)
        slack_m, before, self._camera_ws = self._step_m * np.sqrt(0.5), self._camera_ws, camera_ws
        same = self._focus is not None and np.array_equal(cell[[0, 2]], np.floor(self._focus / self._step_m)[[0, 2]])
        if same:
            if self._sown and before is not None:
                self._prepare(cell, camera_ws, camera_ws - before, slack_m)
            return
        focus = (cell + 0.5) * self._step_m
        if self._sown:
            preserve = self._simulation.preserve if self._simulation else None
            again = not np.array_equal(anchor_ws, self._sown_from_ws)
            if self.field.sow(focus, slack_m, preserve, again=again):
                self.visible.forget()
            self._sown_from_ws = anchor_ws
        self._focus = focus

    def _prepare(self, cell: Floats, camera_ws: Floats, way: Floats, slack_m: float) -> None:
        """Prepare the field for the cell that the camera goes to, in a frame that has less to do."""
        if not way[[0, 2]].any():
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            left = ((cell + (way > 0.0)) * self._step_m - camera_ws) / way
        axis = 0 if not way[2] or (way[0] and left[0] < left[2]) else 2
        cell = cell.copy()
        cell[axis] += np.sign(way[axis])
        focus = (cell + 0.5) * self._step_m
        if np.array_equal(anchor_near(focus), self._anchor_ws):
            self.field.prepare(focus, slack_m)

    def _count_from(self, anchor_ws: Floats) -> None:
        """Count points of the world from another anchor in shaders."""
        self._anchor_ws = anchor_ws
        for part in (self.ground, self.field, self._winds, self._forces, self._poses):
            part.count_from(anchor_ws)

    def can_change(self, scene: Scene) -> bool:
        """Return whether shaders, pictures and the field are good for what `change` takes over of another scene."""
        return (
            self._same_but_scenery(scene)
            and absent_forces(scene) == absent_forces(self.scene)
            and same_kinds(self.scene.wind, scene.wind)
            and (
                scene.colour == self.scene.colour
                or all(isinstance(each.colour, NoiseColour) for each in (self.scene, scene))
            )
        )

    def change(self, scene: Scene) -> None:
        """Take over another scene's winds, forces, scenery and colours of grass; `can_change` must hold."""
        if scene.object != self.scene.object:
            self._stand(scene)
        if scene.force != self.scene.force:
            forces = Forces(self.device, scene)
            self._forces.release()
            self._forces = forces
            forces.count_from(self._anchor_ws)
            self.bindings.update(forces.bindings)
        if scene.wind != self.scene.wind:
            self._winds.change(scene, self.ground.heights)
        if (scene.grass, scene.colour) != (self.scene.grass, self.scene.colour):
            self.field.change_colours(scene)
        self.scene = scene

    def move(self, frame: FrameTime) -> None:
        """Put objects in their places, cull for the frame's views if need be, and write the poses they need."""
        self.placed = self.placing.at(frame.time_s)
        self.previously_placed = self.placing.at(frame.previous_time_s)
        self.field.transform(self.placed, frame.time_s)
        moving = False
        for page in self.field.pages:
            if (index := page.object_index) is not None:
                page.previous_from_now = self.previously_placed[index] @ np.linalg.inv(self.placed[index])
                moving |= self.placing.moving[index]
        culled = frame.views != self.visible.views or moving
        if culled:
            self._cull(frame.views)
        chunks = self.visible.chunks
        if self._stateful:
            step = MotionStep(
                frame.time_s, frame.previous_time_s, frame.views[0].camera_ws, self.placing.at, chunks, culled
            )
            for part in self._stateful:
                part.advance(step)
        for page, blades in self._analytic:
            self._poses.write(page, blades, chunks, frame.time_s, frame.previous_time_s)

    @property
    def blades_simulated(self) -> int:
        """Number of blades whose state was advanced for the last frame."""
        return self._simulation.blades if self._simulation else 0

    def _cull(self, views: tuple[View, ...]) -> None:
        stored = self.visible.update(self.field, views)
        left = [needed.eighths for needed in stored]
        if self._simulation:
            left = self._simulation.schedule(stored, self.visible)
        self._analytic = [
            (needed.page, self.visible.add(needed.page, needed.order, eighths))
            for needed, eighths in zip(stored, left, strict=True)
        ]
        self.visible.chunks.cut()

    def saved(self) -> dict[str, npt.NDArray[Any]]:
        """Read back what has state and the focus of the field, as arrays. Empty where nothing has."""
        if not self._stateful or self._focus is None:
            return {}
        found: dict[str, npt.NDArray[Any]] = {"focus": self._focus}
        for part in self._stateful:
            found |= part.saved()
        return found

    def resume(self, saved: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from what `saved` returned. Raises `InputError` where it does not fit the scene."""
        if not self._stateful:
            return
        if "focus" not in saved or saved["focus"].shape != (3,):
            raise InputError(
                "the checkpoint was made before the first frame, or of a scene without simulation or wake"
            )
        self._focus = None
        self.follow(saved["focus"].astype(np.float64))
        for part in self._stateful:
            part.resume(saved)

    def release(self) -> None:
        """Free the GPU resources."""
        for part in (self.depth_pyramid, self._simulation, self._colliders, self._winds, self._forces):
            if part:
                part.release()
        release_all(self.visible, self._poses, self.field, self._clearings, self.ground)
