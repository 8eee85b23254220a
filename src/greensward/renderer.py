"""Order of a frame, WHEN, and the public way to draw one."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.aovs import Aov
from greensward.frame import MIRROR, PICTURE, GeometryPasses
from greensward.gpu.buffers import Releasable, release_all
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.device import Device, Stage
from greensward.gpu.kernels import Bindings
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import View, look_at
from greensward.ground import HeightField
from greensward.library import as_scene
from greensward.objects.placing import Script
from greensward.passes.blur import Blur
from greensward.passes.gbuffer import BladePixels, GBuffer
from greensward.passes.lighting import Lighting
from greensward.passes.post import Post
from greensward.passes.shadows import ShadowMaps
from greensward.passes.temporal import Moment, Temporal
from greensward.passes.water import WaterPass
from greensward.scene import Camera, InputError, Scene
from greensward.techniques import chosen, far_level
from greensward.truth import Truth, camera_record, read_truth
from greensward.viewpoint import camera_view, jitter, place
from greensward.world import FrameTime, World

_FRAME_S = 1.0 / 30.0
_IN_PLACE = {"title", "camera", "sun", "sky", "phong", "shadows", "post", "wind", "force", "grass", "colour"}
"""Parts of a scene that `update` may change without building anew."""
_COLOURS = {
    "root_colour",
    "tip_colour",
    "dry_colour",
    "head_colour",
    "heart_colour",
    "transmittance",
    "roughness",
}
"""Keys of a species that blades do not store."""
_LONGEST_S = 1e9  # single precision tells no seconds apart long before


@dataclass(frozen=True)
class Counts:
    """Numbers of blades that it took to draw a picture."""

    considered: int = 0
    """Blades in the parts of the field that the camera may see, handed to the tests of `[culling]`."""
    simulated: int = 0
    """Blades whose simulation state was advanced."""
    drawn: int = 0
    """Blades that the tests left."""
    pixels: int = 0
    """Pixels of the first sample that show a blade of grass."""


@dataclass(frozen=True)
class Frame:
    """A picture and its ground truth."""

    image: npt.NDArray[np.uint8]
    """sRGB, (height, width, 3), top row first."""
    truth: Truth = field(default_factory=dict)
    """See `greensward.truth.read_truth`; with `camera`, a JSON string."""
    counts: Counts | None = None
    """Numbers of blades that it took."""


Part = TypeVar("Part", bound=Releasable | None)


class Renderer:
    """Draws one scene: to arrays with a headless context, or into a framebuffer of a host program.

    `scene` is a `Scene`, a preset's name or a path. `samples` jittered pictures are averaged for clean edges. With
    `temporal` each frame is one of them, blended into those before it, for pictures that follow each other; after a
    cut, as `passes.temporal.is_cut` has it, they begin anew. A temporal frame with ground truth has its sample at the
    pixels' centres.

    `device` is `auto`, `cpu`, a number from `greensward info`, or a `Device`; with `ctx`, the host's moderngl context
    (OpenGL 4.3 or newer) is used instead and its state is preserved. Renderers on one device share its compiled
    programs; those that are given none share one of their thread. `scripts` move objects by name: each takes a time
    in seconds and returns the centre of the object's base, (3,) with y above the ground, or its matrix, (4, 4) for
    column vectors. Full-screen passes run in `stage`; if not given, in the faster one on this kind of driver.
    Raises `InputError` for what the scene asks and cannot be had.
    """

    def __init__(
        self,
        scene: Scene | str | Path,
        *,
        size: tuple[int, int] = (1280, 720),
        samples: int = 1,
        temporal: bool = False,
        device: Device | str = "auto",
        ctx: moderngl.Context | None = None,
        scripts: Mapping[str, Script] | None = None,
        stage: Stage | None = None,
    ) -> None:
        self.seconds: dict[str, float] = {}
        """Wall-clock seconds by stage so far."""
        if samples < 1:
            raise InputError(f"samples: must be at least 1 (got {samples})")
        if temporal and samples != 1:
            raise InputError(f"samples: must be 1 with temporal, which draws one sample a frame (got {samples})")
        self.samples = samples
        self.temporal = temporal
        scene = as_scene(scene)
        chosen(scene)
        with self._timed("context"):
            self.device = _device_of(device, ctx)
        self.ctx = self.device.ctx
        self.driver = self.device.name
        self._check_size(size)
        self.size = size
        self._scripts = scripts
        self._stage = stage or self.device.best_stage
        with self._timed("ground"):
            heights = HeightField.of(scene)
            place(scene.camera, heights)
        with self._built(), self.device.use():
            self.timers = PassTimers(self.device)
            self._depth = ReversedDepth(self.device)
            self._build(scene, heights)
        self._released = False

    def _build(self, scene: Scene, heights: HeightField) -> None:
        """Build every GPU resource of a scene, with programs of the device's pool."""
        device, size, stage = self.device, self.size, self._stage
        technique, settings = chosen(scene)
        needs = technique.needs(settings)
        bindings: Bindings = {}
        self._parts: list[Releasable] = []
        try:
            self._world = self._own(
                World(device, scene, heights, stage, bindings, self._scripts, needs.stored, needs.beside)
            )
            self._technique = self._own(technique(device, self._world, settings))
            self._far = self._own(far_level(device, self._world))
            self._geometry = self._own(
                GeometryPasses(
                    device, self._world, self._technique, needs, self._far, stage, self._depth, self.timers
                )
            )
            self._shadows = self._own(ShadowMaps(device, self._world))
            self._gbuffer = self._own(GBuffer(device, size, self._depth, stage))
            self._blade_pixels = self._own(BladePixels(device, bindings))
            self._lighting = self._own(Lighting(device, bindings, scene, size, stage))
            water = scene.water
            self._water = self._own(
                WaterPass(device, bindings, scene, water, size, self._depth, stage) if water else None
            )
            self._blur = self._own(Blur(device, bindings, size, stage) if scene.post.blur != "off" else None)
            self._post = self._own(Post(device, bindings, size, stage, averaged=not self.temporal))
            self._temporal = self._own(Temporal(device, bindings, size, stage) if self.temporal else None)
        except BaseException as error:
            self._release_parts()
            bindings.clear()
            device.free_dropped(error)
            raise
        self.scene = scene
        self.technique_name = technique.name
        self._view: View | None = None
        self._counts: Counts | None = None
        self._viewed_from: tuple[Camera, tuple[int, int]] | None = None
        self._all_views: tuple[View, ...]
        self._shadow_views: tuple[View, ...]
        self._mirror: View | None = None
        self._previous: Moment | None = None
        self._time_s = 0.0

    def _own(self, part: Part) -> Part:
        if part is not None:
            self._parts.append(part)
        return part

    def _disown(self, part: Releasable) -> None:
        self._parts.remove(part)
        part.release()

    @property
    def blades(self) -> int:
        """Number of blades sown around the last camera."""
        return self._world.field.count

    @property
    def blades_in_view(self) -> int:
        """Number of blades handed to the technique for the last picture, before its own tests."""
        return self._technique.considered(self._view) if self._view else 0

    @property
    def counts(self) -> Counts:
        """Numbers of blades that the last picture took. The first request after a frame waits for the GPU."""
        if self._view is None:
            return Counts()
        if self._counts is None:
            with self.device.use():
                drawn, pixels = self._technique.drawn(self._view), self._blade_pixels.read()
            self._counts = Counts(*self._handed, drawn, pixels)
        return self._counts

    @property
    def field_bytes(self) -> int:
        """GPU memory of the sown blades in bytes."""
        return self._world.field.nbytes

    @property
    def blended(self) -> int:
        """Number of frames in the temporal picture since it began or the last cut; 0 without `temporal`."""
        return self._temporal.frames if self._temporal else 0

    def render(
        self,
        time_s: float = 0.0,
        *,
        camera: Camera | None = None,
        aovs: Sequence[Aov] = (),
        progress: Callable[[int, int], None] | None = None,
    ) -> Frame:
        """Draw the scene at an instant; `progress(done, total)` is called after each sample.

        Motion is counted from the frame drawn before, or for the first from a thirtieth of a second earlier.
        """
        with self.device.use():
            camera = camera or self.scene.camera
            truth = self._draw(time_s, camera, aovs, progress)
            with self._timed("draw"):
                image = self._post.read()
            return Frame(image, truth, self.counts)

    def draw(self, framebuffer: moderngl.Framebuffer, time_s: float = 0.0, *, camera: Camera | None = None) -> None:
        """Draw the scene into a framebuffer of the host's context, of any size, and preserve the OpenGL state.

        What the framebuffer's depth buffer holds hides the scene, and the scene's depth is written to it,
        as seen through `camera_matrices(camera)`.
        """
        with self.device.use(framebuffer):
            self.resize(framebuffer.size)
            camera = camera or self.scene.camera
            self._draw(time_s, camera, (), None)
            with self.timers.measure("blit"):
                self._post.blit(framebuffer, camera)

    def advance(self, time_s: float, *, camera: Camera | None = None) -> None:
        """Let the grass move on to an instant without drawing it, as `render` and `draw` do before they draw."""
        with self.device.use():
            self._move(time_s, camera or self.scene.camera)

    def checkpoint(self) -> dict[str, npt.NDArray[Any]]:
        """Read back the state after the last frame, as arrays: `resume` continues from it bit for bit.

        `time_s` is the frame's time, float64, and `camera` its camera, JSON. The others are the simulation state of
        the grass, if the scene has any, and the history of `temporal` pictures.
        """
        camera, _ = self._viewed_from or (self.scene.camera, self.size)
        with self.device.use():
            state = {"time_s": np.array(self._time_s), "camera": np.array(camera.model_dump_json())}
            return {**state, **self._world.saved(), **(self._temporal.saved() if self._temporal else {})}

    def resume(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from a checkpoint of the same scene, on the same driver bit for bit.

        `temporal` pictures begin anew if it holds none of this size. Raises `InputError` if it was made of another
        field.
        """
        if "time_s" not in state or state["time_s"].shape != ():
            raise InputError("this is not a checkpoint of greensward")
        try:
            camera = Camera.model_validate_json(str(state["camera"])) if "camera" in state else self.scene.camera
        except ValueError:
            raise InputError("the checkpoint's camera is damaged") from None
        with self.device.use():
            self._world.resume(state)
            view, _ = self._views(camera)
            self._time_s = float(state["time_s"])
            self._previous = view, self._time_s
            if self._temporal:
                self._temporal.resume(state, self._previous)

    def camera_matrices(
        self, camera: Camera | None = None
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Compute `view_from_world` and `clip_from_view` of a camera, each (4, 4) for column vectors."""
        camera = camera or self.scene.camera
        view_from_world = look_at(*place(camera, self._world.ground.heights))
        view = camera_view(camera, self._world.ground.heights, self.size)
        return view_from_world, view.clip_from_world @ np.linalg.inv(view_from_world)

    def update(self, scene: Scene | str | Path) -> None:
        """Draw another scene from now on, with the least work that it needs.

        Changed in place, within milliseconds: title, camera, sun, sky, shadows, tone, numbers of `[phong]`, of winds
        and of noises of colour, colours of grass, and forces if the scene has some before and after. All else is
        built anew, with the programs and heights that there are; the state of the grass begins anew then. Raises
        `InputError` for what the scene asks and cannot be had; the renderer goes on with the scene that it has.
        """
        scene = as_scene(scene)
        if scene == self.scene and self.scene.folder == scene.folder:
            return
        chosen(scene)
        if self.updates_in_place(scene):
            self._update_in_place(scene)
            return
        before, old = self.scene, self._world.ground.heights
        heights = old if _same_heights(before, scene) else HeightField.of(scene)
        place(scene.camera, heights)
        with self._built(), self.device.use():
            self._release_parts()
            try:
                self._build(scene, heights)
            except BaseException:
                self._build(before, old)
                raise

    def updates_in_place(self, scene: Scene) -> bool:
        """Return whether `update` to a scene takes milliseconds and keeps the state of the grass."""
        before = self.scene
        differs = {name for name in Scene.model_fields if getattr(before, name) != getattr(scene, name)}
        return (
            not differs - _IN_PLACE
            and before.folder == scene.folder
            and before.camera.far_m == scene.camera.far_m
            and (before.phong is None) == (scene.phong is None)
            and (before.post.blur == "off") == (scene.post.blur == "off")
            and self._world.can_change(scene)
            and ("grass" not in differs or (self._colours_are_looked_up() and _same_but_colours(before, scene)))
        )

    def _colours_are_looked_up(self) -> bool:
        """Return whether no picture of blades was made with their colours."""
        return self._far is None and self._technique.needs(chosen(self.scene)[1]).stored

    def _update_in_place(self, scene: Scene) -> None:
        before = self.scene
        place(scene.camera, self._world.ground.heights)
        with self.device.use():
            self._world.change(scene)
            if any(getattr(before, name) != getattr(scene, name) for name in ("sun", "sky", "phong", "post")):
                self._lighting.relight(scene)
                if self._water:
                    self._water.relight(scene)
            if before.sun != scene.sun or before.shadows != scene.shadows:
                self._disown(self._shadows)
                self._shadows = self._own(ShadowMaps(self.device, self._world))
        self.scene = scene
        self._viewed_from = None

    def resize(self, size: tuple[int, int]) -> None:
        """Draw pictures of another size from now on."""
        if size == self.size:
            return
        self._check_size(size)
        with self.device.use():
            self._disown(self._gbuffer)
            self._gbuffer = self._own(GBuffer(self.device, size, self._depth, self._stage))
            self._lighting.resize(size)
            self._post.resize(size)
            for part in (self._water, self._blur, self._temporal):
                if part:
                    part.resize(size)
        self.size = size
        self._previous = None

    def _draw(
        self,
        time_s: float,
        camera: Camera,
        aovs: Sequence[str],
        progress: Callable[[int, int], None] | None,
    ) -> Truth:
        """The frame, top to bottom: sow, move, shadows, then for every sample surfaces, light, tone; then history."""
        truth: Truth = {}
        view, shadow_views = self._views(camera)
        previous = self._previous
        previous_view = previous[0] if previous else view
        frame_time = self._move(time_s, camera)
        first = self._temporal.follow(previous, (view, time_s)) if self._temporal else 0
        with self._timed("draw"):
            with self.timers.measure("move"):
                self._geometry.update(frame_time)
            self._geometry.fill_shadow_maps(self._shadows.framebuffers, shadow_views)
            for sample in range(first, first + self.samples):
                offset_px = jitter(0 if self._temporal and aovs else sample)  # truth is of the pixels' centres
                mirrored = self._mirrored(offset_px, shadow_views, sample)
                occlusion = sample == first or mirrored is not None
                self._geometry.fill(self._gbuffer, view, previous_view, offset_px, slot=PICTURE, occlusion=occlusion)
                with self.timers.measure("light"):
                    light = self._lighting.shade(self._gbuffer, self._shadows, shadow_views, sample)
                if self._water:
                    with self.timers.measure("water"):
                        light = self._water.cover(light, mirrored, self._gbuffer, time_s)
                if sample == first:
                    with self.timers.measure("post"):
                        self._blade_pixels.count(self._gbuffer)
                    if aovs:
                        truth = read_truth(self._gbuffer, aovs, self._geometry.identify)
                if self._blur:
                    with self.timers.measure("blur"):
                        light = self._blur.run(light)
                with self.timers.measure("post"):
                    picture = self._post.accumulate(light, sample)
                if progress is not None:
                    self.ctx.finish()
                    progress(sample - first + 1, self.samples)
            with self.timers.measure("post"):
                if self._temporal:
                    picture = self._temporal.blend(picture, (view, time_s))
                self._post.encode(picture)
        if aovs:
            view_from_world, _ = self.camera_matrices(camera)
            truth["camera"] = np.array(camera_record(camera, view.clip_from_world, view_from_world, self.size))
        self._view, self._counts = view, None
        self._handed = self.blades_in_view, self._world.blades_simulated
        return truth

    def _mirrored(
        self, offset_px: tuple[float, float], shadow_views: Sequence[View], sample: int
    ) -> moderngl.Texture | None:
        """Light of what the water mirrors, if it does."""
        water, view = self._water, self._mirror
        if not (water and view and water.gbuffer and water.lighting):
            return None
        self._geometry.fill(water.gbuffer, view, view, offset_px, slot=MIRROR, occlusion=True)
        with self.timers.measure("water"):
            return water.lighting.shade(water.gbuffer, self._shadows, shadow_views, sample)

    def _move(self, time_s: float, camera: Camera) -> FrameTime:
        """Sow around the camera if need be, and move the grass on to an instant."""
        if not abs(time_s) <= _LONGEST_S:
            raise InputError(f"time: must be a finite number of seconds, at most a billion (got {time_s})")
        view, _ = self._views(camera)
        _, previous_s = self._previous or (view, time_s - _FRAME_S)
        frame_time = FrameTime(time_s, previous_s, self._all_views)
        self.timers.start_frame()
        with self._timed("sow"):
            self._world.follow(view.camera_ws)
        with self._timed("draw"), self.timers.measure("move"):
            self._world.move(frame_time)
        self._previous, self._time_s = (view, time_s), time_s
        return frame_time

    def _views(self, camera: Camera) -> tuple[View, tuple[View, ...]]:
        """The camera's view and those of its shadow maps; the same objects while neither camera nor size change."""
        if self._viewed_from != (camera, self.size):
            view = camera_view(camera, self._world.ground.heights, self.size)
            self._picture, self._shadow_views = view, self._shadows.views(view)
            self._mirror = self._water.mirror(view) if self._water else None
            self._all_views = view, *self._shadow_views, *([self._mirror] if self._mirror else [])
            self._viewed_from = camera, self.size
        return self._picture, self._shadow_views

    def _check_size(self, size: tuple[int, int]) -> None:
        limit = self.device.limits.picture_px
        if not all(1 <= edge <= limit for edge in size):
            raise InputError(f"size: must be 1 to {limit} pixels a side on this driver (got {size[0]}x{size[1]})")

    @contextmanager
    def _built(self) -> Iterator[None]:
        """Time what is built inside, and the shaders of it apart."""
        programs = self.device.programs
        before = programs.seconds
        with self._timed("build"):
            yield
        shaders = programs.seconds - before
        self.seconds["build"] -= shaders
        self.seconds["shaders"] = self.seconds.get("shaders", 0.0) + shaders

    def _timed(self, name: str) -> "_Timed":
        return _Timed(self.seconds, name)

    def release(self) -> None:
        """Free every GPU resource; compiled programs stay with the device."""
        if self._released:
            return
        self._released = True
        with self.device.use():
            self._release_parts()

    def _release_parts(self) -> None:
        release_all(*reversed(self._parts))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


class _Timed:
    """Adds the wall-clock time of a `with` block to a stage's total."""

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._started = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] = self._seconds.get(self._name, 0.0) + time.perf_counter() - self._started


def _device_of(device: Device | str, ctx: moderngl.Context | None) -> Device:
    if ctx is not None:
        return Device.of(ctx)
    return Device.shared(device) if isinstance(device, str) else device


def _same_heights(before: Scene, scene: Scene) -> bool:
    return (before.ground, before.seed, before.folder) == (scene.ground, scene.seed, scene.folder)


def _same_but_colours(before: Scene, scene: Scene) -> bool:
    if len(before.grass) != len(scene.grass):
        return False
    return all(
        a.model_dump(exclude=_COLOURS) == b.model_dump(exclude=_COLOURS)
        for a, b in zip(before.grass, scene.grass, strict=True)
    )
