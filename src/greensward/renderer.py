"""WHEN: the order of a frame, and the public way to draw one."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Self

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.context import driver_name, open_context
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.pixel_pass import Shell, best_shell
from greensward.gpu.state import kept_state
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import View, look
from greensward.ground import HeightField
from greensward.objects.placing import Script
from greensward.passes.blur import Blur
from greensward.passes.gbuffer import BladePixels, GBuffer
from greensward.passes.lighting import Lighting
from greensward.passes.post import Post
from greensward.passes.shadows import ShadowMaps
from greensward.passes.temporal import Moment, Temporal
from greensward.passes.water import WaterPass
from greensward.scene import Camera, InputError, Scene
from greensward.surfaces import MIRROR, PICTURE, Surfaces
from greensward.techniques import chosen, far_level
from greensward.truth import Truth, camera_record, read_truth
from greensward.viewpoint import camera_view, jitter, place
from greensward.world import Instant, World

_FRAME_S = 1.0 / 30.0
_LIGHT = {"title", "camera", "sun", "sky", "shadows", "post", "wind", "force"}
"""What `change` may change."""
_LONGEST_S = 1e9  # single precision tells no seconds apart long before


@dataclass(frozen=True)
class Counts:
    """How many blades it took to draw a picture."""

    considered: int = 0
    """Blades in the parts of the field that the camera may see, handed to the tests of `[culling]`."""
    simulated: int = 0
    """Blades whose memory was carried on."""
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
    """How many blades it took."""


class Renderer:
    """Draws one scene: to arrays with its own headless context, or into a framebuffer of the caller's.

    `samples` jittered pictures are averaged for clean edges. With `temporal` each frame is one of them, blended into
    those before it, for pictures that follow each other; after a cut, as `passes.temporal.is_cut` has it, they begin
    anew. A temporal frame with ground truth has its sample at the pixels' centres.

    `device` is `auto`, `cpu` or a number from `greensward info`; with `ctx`, the caller's moderngl context (OpenGL
    4.3 or newer) is used instead and its state is kept. `scripts` move objects by name: each takes a time in seconds
    and returns the centre of the object's base, (3,) with y above the ground, or its matrix, (4, 4) for column
    vectors. `stray_m` is how far the camera may go before the field is sown anew around it: more asks for more memory
    and less often for sowing; if not given, it is 0.15 of `sowing.full_density_m`.
    Raises `InputError` for what the scene asks and cannot be had.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        size: tuple[int, int] = (1280, 720),
        samples: int = 1,
        temporal: bool = False,
        device: str = "auto",
        ctx: moderngl.Context | None = None,
        scripts: Mapping[str, Script] | None = None,
        shell: Shell | None = None,
        stray_m: float | None = None,
    ) -> None:
        self.scene = scene
        self.seconds: dict[str, float] = {}
        """Wall-clock seconds by stage so far."""
        if samples < 1:
            raise InputError(f"samples: must be at least 1 (got {samples})")
        if temporal and samples != 1:
            raise InputError(f"samples: must be 1 with temporal, which draws one sample a frame (got {samples})")
        self.samples = samples
        self.temporal = temporal
        self._technique_type, self._settings = chosen(scene)
        self.technique_name = self._technique_type.name
        with self._stage("context"):
            self._owned = open_context(device) if ctx is None else None
            self.ctx: moderngl.Context = ctx or self._owned  # type: ignore[assignment]
        try:
            self._check_size(size)
            self.driver = driver_name(self.ctx)
            with self._stage("ground"):
                heights = HeightField.of(scene)
                place(scene.camera, heights)
            with self._stage("shaders"), kept_state(self.ctx):
                self._build(heights, size, scripts, shell, stray_m)
        except BaseException:
            if self._owned is not None:
                self._owned.release()
            raise
        self._view: View | None = None
        self._counts: Counts | None = None
        self._seen_from: tuple[Camera, tuple[int, int]] | None = None
        self._all_views: tuple[View, ...]
        self._shadow_views: tuple[View, ...]
        self._mirror: View | None = None
        self._previous: Moment | None = None
        self._time_s = 0.0
        self._released = False

    def _build(
        self,
        heights: HeightField,
        size: tuple[int, int],
        scripts: Mapping[str, Script] | None,
        shell: Shell | None,
        stray_m: float | None,
    ) -> None:
        ctx = self.ctx
        self.size = size
        self.timers = PassTimers(ctx)
        self._depth = ReversedDepth(ctx)
        self._shell = shell = shell or best_shell(ctx)
        sown = self._technique_type.draws_field(self._settings)
        self._world = World(ctx, self.scene, heights, shell, scripts, sown, stray_m)
        self._technique = self._technique_type(ctx, self._world, self._settings)
        self._far = far_level(ctx, self._world)
        self._surfaces = Surfaces(ctx, self._world, self._technique, self._far, shell, self._depth, self.timers)
        self._shadows = ShadowMaps(ctx, self._world)
        self._gbuffer = GBuffer(ctx, size, self._depth, shell)
        self._blade_pixels = BladePixels(ctx)
        self._lighting = Lighting(ctx, self.scene, size, shell)
        water = self.scene.water
        self._water = WaterPass(ctx, self.scene, water, size, self._depth, shell) if water else None
        self._blur = Blur(ctx, size, shell) if self.scene.post.blur != "off" else None
        self._post = Post(ctx, size, shell, averaged=not self.temporal)
        self._temporal = Temporal(ctx, size, shell) if self.temporal else None

    @property
    def blades(self) -> int:
        """Blades sown around the last camera."""
        return self._world.field.count

    @property
    def blades_in_view(self) -> int:
        """Blades handed to the technique for the last picture, before its own tests."""
        return self._technique.considered(self._view) if self._view else 0

    @property
    def counts(self) -> Counts:
        """How many blades the last picture took. Asked for the first time after a frame, it waits for the GPU."""
        if self._view is None:
            return Counts()
        if self._counts is None:
            with self._kept():
                drawn, pixels = self._technique.drawn(self._view), self._blade_pixels.read()
            self._counts = Counts(*self._handed, drawn, pixels)
        return self._counts

    @property
    def field_bytes(self) -> int:
        """GPU memory of the sown blades in bytes."""
        return self._world.field.nbytes

    @property
    def blended(self) -> int:
        """Frames that the temporal picture holds since it began or the last cut; 0 without `temporal`."""
        return self._temporal.frames if self._temporal else 0

    def render(
        self,
        time_s: float = 0.0,
        *,
        camera: Camera | None = None,
        aovs: Sequence[str] = (),
        progress: Callable[[int, int], None] | None = None,
    ) -> Frame:
        """Draw the scene at an instant; `progress(done, total)` is called after each sample.

        Motion is counted from the frame drawn before, or for the first from a thirtieth of a second earlier.
        """
        with self._kept():
            camera = camera or self.scene.camera
            truth = self._draw(time_s, camera, aovs, progress)
            with self._stage("draw"):
                image = self._post.read()
            return Frame(image, truth, self.counts)

    def draw(self, framebuffer: moderngl.Framebuffer, time_s: float = 0.0, *, camera: Camera | None = None) -> None:
        """Draw the scene into a framebuffer of the caller's context, of any size, and keep the GL state.

        What the framebuffer's depth buffer holds hides the scene, and the scene's depth is written to it,
        as seen through `camera_matrices(camera)`.
        """
        with self._kept(framebuffer):
            self.resize(framebuffer.size)
            camera = camera or self.scene.camera
            self._draw(time_s, camera, (), None)
            with self.timers.measure("blit"):
                self._post.blit(framebuffer, self._gbuffer, camera)

    def advance(self, time_s: float, *, camera: Camera | None = None) -> None:
        """Let the grass move on to an instant without drawing it, as `render` and `draw` do before they draw."""
        with self._kept():
            self._move(time_s, camera or self.scene.camera)

    def checkpoint(self) -> dict[str, npt.NDArray[Any]]:
        """The memory of the grass after the last frame, as arrays: `resume` continues from it bit for bit.

        `time_s` is the instant it is of, float64, and `camera` its camera, JSON; beside them stand what the grass
        remembers, if the scene has simulation, and the history of `temporal` pictures.
        """
        camera, _ = self._seen_from or (self.scene.camera, self.size)
        with self._kept():
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
        with self._kept():
            self._world.resume(state)
            view, _ = self._views(camera)
            self._time_s = float(state["time_s"])
            self._previous = view, self._time_s
            if self._temporal:
                self._temporal.resume(state, self._previous)

    def camera_matrices(
        self, camera: Camera | None = None
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """`view_from_world` and `clip_from_view`, each (4, 4) for column vectors, of a camera at this size."""
        camera = camera or self.scene.camera
        view_from_world = look(*place(camera, self._world.ground.heights))
        view = camera_view(camera, self._world.ground.heights, self.size)
        return view_from_world, view.clip_from_world @ np.linalg.inv(view_from_world)

    def change(self, scene: Scene) -> bool:
        """Draw another scene from now on, unless that asks for sowing or for shaders; returns whether it is drawn.

        It is where it differs in title, camera, sun, sky, shadows, in `post` but not by a blur that comes or goes, in
        numbers of winds, or in forces while there are some before and after. Nothing changes where it is not.
        """
        before = self.scene
        differs = {name for name in Scene.model_fields if getattr(before, name) != getattr(scene, name)}
        same_far = before.camera.far_m == scene.camera.far_m
        same_blur = (before.post.blur == "off") == (scene.post.blur == "off")
        if differs - _LIGHT or not (same_far and same_blur) or before.resolve(".") != scene.resolve("."):
            return False
        place(scene.camera, self._world.ground.heights)
        with self._kept():
            if not self._world.change(scene):
                return False
            if differs & {"sun", "sky", "post"}:
                self._lighting.relight(scene)
                if self._water:
                    self._water.relight(scene)
            if differs & {"sun", "shadows"}:
                self._shadows.release()
                self._shadows = ShadowMaps(self.ctx, self._world)
        self.scene = scene
        self._seen_from = None
        return True

    def resize(self, size: tuple[int, int]) -> None:
        """Draw pictures of another size from now on."""
        if size == self.size:
            return
        self._check_size(size)
        with self._kept():
            self._gbuffer.release()
            self._gbuffer = GBuffer(self.ctx, size, self._depth, self._shell)
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
        instant = self._move(time_s, camera)
        first = self._temporal.follow(previous, (view, time_s)) if self._temporal else 0
        with self._stage("draw"):
            with self.timers.measure("move"):
                self._surfaces.update(instant)
            self._surfaces.cast(self._shadows.framebuffers, shadow_views)
            for sample in range(first, first + self.samples):
                offset_px = jitter(0 if self._temporal and aovs else sample)  # truth is of the pixels' centres
                mirrored = self._mirrored(offset_px, shadow_views, sample)
                hiding = sample == first or mirrored is not None
                self._surfaces.fill(self._gbuffer, view, previous_view, offset_px, slot=PICTURE, hiding=hiding)
                with self.timers.measure("light"):
                    light = self._lighting.shade(self._gbuffer, self._shadows, shadow_views, sample)
                if self._water:
                    with self.timers.measure("water"):
                        light = self._water.cover(light, mirrored, self._gbuffer, time_s)
                if sample == first:
                    with self.timers.measure("post"):
                        self._blade_pixels.count(self._gbuffer)
                    if aovs:
                        truth = read_truth(self._gbuffer, aovs)
                if self._blur:
                    with self.timers.measure("blur"):
                        light = self._blur.run(light, self._gbuffer)
                with self.timers.measure("post"):
                    picture = self._post.accumulate(light, sample)
                if progress is not None:
                    self.ctx.finish()
                    progress(sample - first + 1, self.samples)
            with self.timers.measure("post"):
                if self._temporal:
                    picture = self._temporal.blend(picture, self._gbuffer, (view, time_s))
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
        """The light of what the water mirrors, if it does."""
        water, view = self._water, self._mirror
        if not (water and view and water.gbuffer and water.lighting):
            return None
        self._surfaces.fill(water.gbuffer, view, view, offset_px, slot=MIRROR, hiding=True)
        with self.timers.measure("water"):
            return water.lighting.shade(water.gbuffer, self._shadows, shadow_views, sample)

    def _move(self, time_s: float, camera: Camera) -> Instant:
        """Sow around the camera if need be, and move the grass on to an instant."""
        if not abs(time_s) <= _LONGEST_S:
            raise InputError(f"time: must be a finite number of seconds, at most a billion (got {time_s})")
        view, _ = self._views(camera)
        _, previous_s = self._previous or (view, time_s - _FRAME_S)
        instant = Instant(time_s, previous_s, self._all_views)
        self.timers.start_frame()
        with self._stage("sow"):
            if self._world.follow(view.camera_ws):
                self.ctx.finish()
        with self._stage("draw"):
            self._world.bind()
            with self.timers.measure("move"):
                self._world.move(instant)
        self._previous, self._time_s = (view, time_s), time_s
        return instant

    def _views(self, camera: Camera) -> tuple[View, tuple[View, ...]]:
        """The camera's view and those of its shadow maps; the same objects while neither camera nor size change."""
        if self._seen_from != (camera, self.size):
            view = camera_view(camera, self._world.ground.heights, self.size)
            self._picture, self._shadow_views = view, self._shadows.views(view)
            self._mirror = self._water.mirror(view) if self._water else None
            self._all_views = view, *self._shadow_views, *([self._mirror] if self._mirror else [])
            self._seen_from = camera, self.size
        return self._picture, self._shadow_views

    def _check_size(self, size: tuple[int, int]) -> None:
        if self.ctx.version_code < 430:
            raise InputError(f"ctx: must be OpenGL 4.3 or newer (got {self.ctx.version_code / 100:.1f})")
        limit = min(*self.ctx.info["GL_MAX_VIEWPORT_DIMS"], self.ctx.info["GL_MAX_TEXTURE_SIZE"])
        if not all(1 <= edge <= limit for edge in size):
            raise InputError(f"size: must be 1 to {limit} pixels a side on this driver (got {size[0]}x{size[1]})")

    def _stage(self, name: str) -> "_Stage":
        return _Stage(self.seconds, name)

    def _kept(self, *framebuffers: moderngl.Framebuffer) -> AbstractContextManager[None]:
        """While drawing: a caller's context keeps its state; the renderer's own is made current, and has none."""
        if self._owned is None:
            return kept_state(self.ctx, *framebuffers)
        self._owned.__enter__()  # type: ignore[no-untyped-call]  # another renderer's may be current
        return nullcontext()

    def release(self) -> None:
        """Free every GPU resource, and the context if it is the renderer's own."""
        if self._released:
            return
        self._released = True
        with self._kept():
            for part in (
                self._technique,
                self._surfaces,
                self._shadows,
                self._gbuffer,
                self._blade_pixels,
                self._lighting,
                self._post,
                *(part for part in (self._far, self._water, self._blur, self._temporal) if part),
                self._world,
            ):
                part.release()
        if self._owned is not None:
            self._owned.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


class _Stage:
    """Adds the wall-clock time of a `with` block to a stage's total."""

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._started = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] = self._seconds.get(self._name, 0.0) + time.perf_counter() - self._started
