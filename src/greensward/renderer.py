"""Order of a frame, WHEN, and the public way to draw one."""

import itertools
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.aovs import Aov, unknown_aov
from greensward.eyes import Eye, Views, camera_of, is_whole, windows_of
from greensward.frame import MIRROR, PICTURE, GeometryPasses
from greensward.gpu.buffers import release_all
from greensward.gpu.current import context_kept
from greensward.gpu.depth import ReversedDepth
from greensward.gpu.device import Device, Releasable, Stage
from greensward.gpu.kernels import Bindings
from greensward.gpu.timers import PassTimers
from greensward.gpu.view import View
from greensward.ground import HeightField
from greensward.lens import Lens, lens_key
from greensward.library import as_scene
from greensward.objects.placing import Placed, Script, placed_at, refuse_unknown
from greensward.passes.bloom import Bloom
from greensward.passes.blur import Blur
from greensward.passes.gbuffer import BladePixels, GBuffer
from greensward.passes.light import cloud_origin, sun_at_ground, to_sun
from greensward.passes.lighting import Lighting
from greensward.passes.post import Encoding, Look, Post
from greensward.passes.post.window import Blit
from greensward.passes.shadows import ShadowMaps
from greensward.passes.temporal import Moment, Temporal
from greensward.passes.water import WaterPass
from greensward.queries import Blade, Hit, Light, blade_with, hit_in, points_on_ground, probe_view, unit_ray
from greensward.scene import Camera, GreenswardError, InputError, Scene
from greensward.scene.problems import short
from greensward.techniques import chosen, far_level
from greensward.truth import Truth, camera_record, read_truth
from greensward.viewpoint import camera_view, jitter, matrices_of, place
from greensward.world import FrameTime, World

_FRAME_S = 1.0 / 30.0
_IN_PLACE = {
    "title",
    "camera",
    "sun",
    "sky",
    "fog",
    "phong",
    "shadows",
    "post",
    "wind",
    "force",
    "object",
    "grass",
    "colour",
}
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
    """Pixels of the first sample that show a blade of grass; of a lens that bends lines, those of its first face."""


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
    column vectors. Objects named in `movable` wait for `place`. Full-screen passes run in `stage`; if not given, in
    the faster one on this kind of driver.
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
        movable: Collection[str] = (),
        stage: Stage | None = None,
    ) -> None:
        self.seconds: dict[str, float] = {}
        """Wall-clock seconds by stage so far."""
        if not is_whole(samples) or samples < 1:
            raise InputError(f"samples: must be a whole number of at least 1 (got {samples!r})")
        if stage not in (None, "fragment", "compute"):
            raise InputError(f'stage: must be "fragment" or "compute" (got {stage!r})')
        if ctx is not None and not isinstance(ctx, moderngl.Context):
            raise InputError(f"ctx: must be a moderngl.Context (got {type(ctx).__name__})")
        if temporal and samples != 1:
            raise InputError(f"samples: must be 1 with temporal, which draws one sample a frame (got {samples})")
        self.samples = samples
        self.temporal = temporal
        scene = as_scene(scene)
        chosen(scene)
        with context_kept():
            with self._timed("context"):
                self.device = _device_of(device, ctx)
            self.ctx = self.device.ctx
            self.driver = self.device.name
            self._check_size(size)
            self.size = size
            self._scripts = dict(scripts or {})
            refuse_unknown(movable, scene.object, "movable")
            if both := sorted(set(movable) & set(self._scripts)):
                raise InputError(f"movable: {both[0]}: is moved by its script; leave one of the two out")
            self._placed = {name: Placed() for name in movable}
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
                World(
                    device,
                    scene,
                    heights,
                    stage,
                    bindings,
                    self._scripts | self._placed,
                    needs.stored,
                    needs.beside,
                    needs.on_ground,
                    needs.density,
                )
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
            shines = scene.post.bloom > 0.0
            self._bloom = self._own(Bloom(device, bindings, size, scene.post.bloom_size, stage) if shines else None)
            self._blur = self._own(Blur(device, bindings, size, stage) if scene.post.blur != "off" else None)
            self._post = self._own(Post(device, bindings, size, stage, averaged=not self.temporal))
            self._blit = self._own(Blit(device, bindings))
            self._latest_lens: tuple[tuple[Camera, tuple[int, int]], Lens] | None = None
            self._histories: list[Temporal] = []
            if self.temporal:
                self._history(0)
        except BaseException as error:
            self._release_parts()
            bindings.clear()
            device.free_dropped(error)
            raise
        self.scene = scene
        self.technique_name = technique.name
        self._view: View | None = None
        self._counts: Counts | None = None
        self._views = Views()
        self._moments: tuple[Moment, ...] = ()
        self._time_s = 0.0

    def _history(self, eye: int) -> Temporal:
        """History of the pictures of an eye."""
        while len(self._histories) <= eye:
            history = Temporal(self.device, self._world.bindings, self.size, self._stage)
            self._histories.append(self._own(history))
        return self._histories[eye]

    def _refuse_released(self) -> None:
        if self._released:
            raise GreenswardError("this renderer has been released: make another")

    @contextmanager
    def _use(self, *framebuffers: moderngl.Framebuffer) -> Iterator[None]:
        """Draw inside, in a context that is left as it was."""
        self._refuse_released()
        with self.device.use(*framebuffers):
            yield

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
        self._refuse_released()
        return self._world.field.count

    @property
    def blades_in_view(self) -> int:
        """Number of blades handed to the technique for the last picture, before its own tests."""
        return self._technique.considered(self._view) if self._view else 0

    @property
    def counts(self) -> Counts:
        """Numbers of blades that the last picture took. The first request after a frame waits for the GPU."""
        self._refuse_released()
        if self._view is None:
            return Counts()
        if self._counts is None:
            with self._use():
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
        return self._histories[0].frames if self._histories else 0

    def render(
        self,
        time_s: float = 0.0,
        *,
        camera: Camera | None = None,
        view_from_world: npt.ArrayLike | None = None,
        clip_from_view: npt.ArrayLike | None = None,
        aovs: Sequence[Aov] = (),
        progress: Callable[[int, int], None] | None = None,
    ) -> Frame:
        """Draw the scene at an instant; `progress(done, total)` is called after each sample.

        It is seen by the scene's camera, by another, or through a program's own matrices as
        `camera_from_matrices` takes them. Motion is counted from the frame drawn before, or for the first from a
        thirtieth of a second earlier.
        """
        if unknown := unknown_aov(aovs):
            raise InputError(f"aovs: {unknown}")
        with self._use():
            camera = camera_of(camera, self.scene.camera, view_from_world, clip_from_view, self.size)
            images: list[npt.NDArray[np.uint8]] = []

            def read(*_: object) -> None:
                with self._timed("draw"):
                    images.append(self._post.read())

            truth = self._draw(time_s, (camera,), Look(), read, aovs, progress)
            return Frame(images[0], truth, self.counts)

    def draw(
        self,
        framebuffer: moderngl.Framebuffer,
        time_s: float = 0.0,
        *,
        camera: Camera | None = None,
        view_from_world: npt.ArrayLike | None = None,
        clip_from_view: npt.ArrayLike | None = None,
        layer: int | None = None,
        encoding: Encoding = "srgb",
        sky: bool = True,
        ground: bool = True,
    ) -> None:
        """Draw the scene into a framebuffer of the host's context, and preserve the OpenGL state.

        It fills the framebuffer's viewport. What the depth buffer holds hides the scene, and the scene's depth is
        written to it, as seen through `camera_matrices(camera)`, or through the host's own matrices, (4, 4) for
        column vectors, with the context's clip control and depth range. Of the colour attachments only the first is
        drawn into, in a layer if it has any. Without `sky` or `ground`, what the framebuffer holds stays there.
        Raises `InputError` for matrices that are no camera and for a framebuffer of another context.
        """
        eye = Eye(framebuffer, camera, view_from_world, clip_from_view, None, layer)
        self.draw_eyes((eye,), time_s, encoding=encoding, sky=sky, ground=ground)

    def draw_eyes(
        self,
        eyes: Iterable[Eye],
        time_s: float = 0.0,
        *,
        encoding: Encoding = "srgb",
        sky: bool = True,
        ground: bool = True,
    ) -> None:
        """Draw several pictures of one instant, such as those of two eyes, as `draw` does each.

        They share all that does not depend on the eye: the field, which is sown around the first, its motion and the
        shadows. Their viewports are of one size.
        """
        look = Look(encoding, sky, ground)
        self._refuse_released()
        if self.temporal and not look.is_whole:
            raise InputError("sky, ground: must be drawn by a renderer with temporal; leave out temporal=True")
        with context_kept():
            self.device.make_current()
            windows = windows_of(self.device, eyes, self.scene.camera)
        if not windows:
            return  # all are folded away
        self.resize(windows[0][0].viewport[2:])
        with self._use(*{id(window.framebuffer): window.framebuffer for window, _ in windows}.values()):

            def show(eye: int, picture: moderngl.Texture) -> None:
                with self.timers.measure("blit"):
                    self._blit.run(picture, windows[eye][0], look, self._post)

            self._draw(time_s, tuple(camera for _, camera in windows), look, show)

    def place(self, name: str, where: npt.ArrayLike) -> None:
        """Put an object in a place from the next frame on: the centre of its base, (3,), or its matrix, (4, 4).

        As scripts give them. Between two frames it moves evenly. The first call for an object that is neither in
        `movable` nor in `scripts`, and that clears, presses or bears grass, builds the field anew, as `update` does.
        Raises `InputError` for a name that no object has and for what is neither three numbers nor a rigid matrix.
        """
        where = placed_at(f"place: {name}", where)
        if name in self._placed:
            self._put(name, where)
            return
        if name in self._scripts:
            raise InputError(f"place: {name}: is moved by its script; leave one of the two out")
        refuse_unknown([name], self._world.objects, "place")
        self._placed[name] = Placed()
        self._put(name, where)
        if not self._world.script(name, self._placed[name]):
            self._rebuild(self.scene, self._world.ground.heights)

    def _put(self, name: str, where: npt.NDArray[np.float64]) -> None:
        placed, index = self._placed[name], self._world.placing.index(name)
        if index is None:
            placed.put(where)  # until the object is there again
            return
        if not placed.is_placed and self._moments:
            placed.begin(self._time_s, self._world.placed[index])
        placed.put(self._world.placing.matrix(index, where))

    def ground_height(self, x: npt.ArrayLike, z: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Height of the ground in metres at points of the world, of their shape. Raises `InputError`."""
        return self._world.ground.heights.height(*points_on_ground(x, z))

    def ground_normal(self, x: npt.ArrayLike, z: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Unit normals of the ground at points of the world, of their shape and (…, 3), likewise."""
        return self._world.ground.heights.normal(*points_on_ground(x, z))

    def light(self) -> Light:
        """Read the light of the scene. Waits for the GPU."""
        with self._use():
            sky = self._lighting.sky_light()
        harmonics = sky["sh"][:, :3].astype(np.float64)
        return Light(to_sun(self.scene), sun_at_ground(self.scene), harmonics, float(sky["exposure"]))

    def blade(self, blade_id: int) -> Blade | None:
        """Find the blade with a permanent id, as `blade_id` holds them. Waits for the GPU.

        None for one that is not stored around the camera, and for what has no blade of its own: flowers, flat tiles,
        pictures of grass, instances. Raises `InputError` for what is no whole number.
        """
        try:
            whole = index(blade_id)
        except TypeError:
            raise InputError(f"blade_id: must be a whole number (got {blade_id!r})") from None
        with self._use():
            return blade_with(self._world, self._world.field.number_of(whole))

    def hit(self, origin_m: npt.ArrayLike, direction: npt.ArrayLike) -> Hit | None:
        """Find the first surface that a ray meets, as it stands at the time of the last frame; None for the sky.

        `origin_m` and `direction` are (3,), in the world. It is found by drawing one pixel, as wide as the picture's,
        and takes about as long as a small frame. Raises `InputError` for a ray that is none.
        """
        origin, along = unit_ray(origin_m, direction)
        _ = self.counts  # of the picture, before the probe is drawn
        with self._use():
            frame = self._views_of(self._views.cameras or (self.scene.camera,))
            view = probe_view(origin, along, frame.pictures[0], frame.cameras[0].far_m)
            with self._timed("draw"):
                self._world.follow(frame.pictures[0].camera_ws)
                now = FrameTime(self._time_s, self._time_s, (*frame.every, view))
                self._world.move(now)
                self._geometry.update(now)
            probe = GBuffer(self.device, (1, 1), self._depth, self._stage)
            try:
                self._geometry.fill(probe, view, view, (0.0, 0.0), slot=PICTURE, occlusion=True)
                return hit_in(probe, self._geometry.identify, self._world, origin, along, view)
            finally:
                probe.release()

    def advance(self, time_s: float, *, camera: Camera | None = None) -> None:
        """Let the grass move on to an instant without drawing it, as `render` and `draw` do before they draw."""
        with self._use():
            self._move(time_s, (camera or self.scene.camera,))

    def checkpoint(self) -> dict[str, npt.NDArray[Any]]:
        """Read back the state after the last frame, as arrays: `resume` continues from it bit for bit.

        `time_s` is the frame's time, float64, and `camera` its camera, JSON. The others are the simulation state of
        the grass, if the scene has any, and the history of `temporal` pictures.
        """
        cameras = self._views.cameras or (self.scene.camera,)
        with self._use():
            state = {"time_s": np.array(self._time_s), "camera": np.array(cameras[0].model_dump_json())}
            return {**state, **self._world.saved(), **(self._histories[0].saved() if self._histories else {})}

    def resume(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Continue from a checkpoint of the same scene, on the same driver bit for bit.

        `temporal` pictures begin anew if it holds none of this size. Raises `InputError` if it was made of another
        field.
        """
        _refuse_damage(state)
        try:
            camera = Camera.model_validate_json(str(state["camera"])) if "camera" in state else self.scene.camera
        except ValueError:
            raise InputError("the checkpoint's camera is damaged") from None
        with self._use():
            self._world.resume(state)
            views = self._views_of((camera,))
            self._time_s = float(state["time_s"])
            self._moments = tuple((view, self._time_s) for view in views.pictures)
            if self._histories:
                self._histories[0].resume(state, self._moments[0])

    def camera_matrices(
        self, camera: Camera | None = None
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Compute `view_from_world` and `clip_from_view` of a camera, each (4, 4) for column vectors.

        Of a fisheye and of a lens that distorts, those of the pinhole with its focal length.
        """
        return matrices_of(camera or self.scene.camera, self._world.ground.heights, self.size)

    def update(self, scene: Scene | str | Path) -> None:
        """Draw another scene from now on, with the least work that it needs.

        Changed in place, within milliseconds: title, camera, sun, sky, shadows, tone, numbers of `[phong]`, of winds
        and of noises of colour, colours of grass, objects that neither clear nor press nor bear grass, and forces if
        the scene has some before and after. All else is built anew, with the programs and heights that there are; the
        state of the grass begins anew then. Raises `InputError` for what the scene asks and cannot be had; the
        renderer goes on with the scene that it has.
        """
        self._refuse_released()
        scene = as_scene(scene)
        if scene == self.scene and self.scene.folder == scene.folder:
            return
        chosen(scene)
        if self.updates_in_place(scene):
            self._update_in_place(scene)
            return
        old = self._world.ground.heights
        heights = old if _same_heights(self.scene, scene) else HeightField.of(scene)
        place(scene.camera, heights)
        self._rebuild(scene, heights)

    def _rebuild(self, scene: Scene, heights: HeightField) -> None:
        before, old = self.scene, self._world.ground.heights
        with self._built(), self._use():
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
            and (before.post.bloom > 0.0) == (scene.post.bloom > 0.0)
            and before.post.bloom_size == scene.post.bloom_size
            and self._world.can_change(scene)
            and ("grass" not in differs or (self._colours_are_looked_up() and _same_but_colours(before, scene)))
        )

    def _colours_are_looked_up(self) -> bool:
        """Return whether no picture of blades was made with their colours."""
        needs = self._technique.needs(chosen(self.scene)[1])
        return self._far is None and needs.stored and needs.on_ground

    def _update_in_place(self, scene: Scene) -> None:
        before = self.scene
        place(scene.camera, self._world.ground.heights)
        with self._use():
            self._world.change(scene)
            if before.object != scene.object:
                self._geometry.change_objects()
            if any(getattr(before, name) != getattr(scene, name) for name in ("sun", "sky", "fog", "phong", "post")):
                self._lighting.relight(scene)
                if self._water:
                    self._water.relight(scene)
            if self._shadows.suits(scene):
                self._shadows.relight()
            else:
                self._disown(self._shadows)
                self._shadows = self._own(ShadowMaps(self.device, self._world))
        self.scene = scene
        self._views = Views()

    def resize(self, size: tuple[int, int]) -> None:
        """Draw pictures of another size from now on."""
        self._refuse_released()
        if size == self.size:
            return
        self._check_size(size)
        with self._use(), self._whole():
            self._fit(size)
            self._post.resize(size)
            for part in (self._bloom, self._blur, *self._histories):
                if part:
                    part.resize(size)
        self.size = size
        self._moments = ()

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Build everything anew, of the size before, where what is inside fails halfway."""
        try:
            yield
        except BaseException:
            self._rebuild(self.scene, self._world.ground.heights)
            raise

    def _fit(self, size: tuple[int, int]) -> None:
        """Fill and light G-buffers of this size from now on."""
        if size == self._gbuffer.size:
            return
        gbuffer = GBuffer(self.device, size, self._depth, self._stage)
        self._disown(self._gbuffer)
        self._gbuffer = self._own(gbuffer)
        self._lighting.resize(size)
        if self._water:
            self._water.resize(size)

    def _draw(
        self,
        time_s: float,
        cameras: tuple[Camera, ...],
        look: Look,
        show: Callable[[int, moderngl.Texture], None],
        aovs: Sequence[Aov] = (),
        progress: Callable[[int, int], None] | None = None,
    ) -> Truth:
        """The frame, top to bottom: sow, move, shadows, then for every sample surfaces, light, tone; then history.

        `show(eye, picture)` takes each eye's picture before the next is begun.
        """
        truth: Truth = {}
        self._views_of(cameras)
        before = self._moments
        frame_time = self._move(time_s, cameras)
        views = self._views
        lens = views.lens
        with self._timed("draw"):
            with self.timers.measure("move"):
                self._geometry.update(frame_time)
            for eye in range(1 if lens else len(views.pictures)):
                now, previous = self._moments[eye], before[eye] if eye < len(before) else None
                history = self._history(eye) if self.temporal else None
                first = history.follow(previous, now, look.encoding) if history else 0
                for sample in range(first, first + self.samples):
                    offset_px = jitter(0 if history and aovs else sample)  # truth is of the pixels' centres
                    if lens:
                        for face in range(len(views.pictures)):
                            light = self._light(face, before, offset_px, sample, sample == first, time_s)
                            lens.gather(light, face)
                        light = lens.gathered
                    else:
                        light = self._light(eye, before, offset_px, sample, sample == first, time_s)
                    if sample == first and aovs:
                        truth = self._truth(cameras[0], aovs, before)
                    if self._blur:
                        with self.timers.measure("blur"):
                            light = self._blur.run(light)
                    if self._bloom:
                        with self.timers.measure("bloom"):
                            light = self._bloom.run(light)
                    with self.timers.measure("post"):
                        picture = self._post.accumulate(light, sample, look)
                    if progress is not None:
                        self.ctx.finish()
                        progress(sample - first + 1, self.samples)
                with self.timers.measure("post"):
                    if history:
                        picture = history.blend(picture, now)
                    picture = self._post.encode(picture, look)
                show(eye, picture)
        self._view, self._counts = views.pictures[0], None
        self._handed = self.blades_in_view, self._world.blades_simulated
        return truth

    def _light(
        self,
        number: int,
        before: Sequence[Moment],
        offset_px: tuple[float, float],
        sample: int,
        first: bool,
        time_s: float,
    ) -> moderngl.Texture:
        """Radiance of what one of the frame's views shows; its surfaces stay in the G-buffer."""
        views = self._views
        shadow_views, mirror = views.shadows[number], views.mirrors[number]
        if (first and (number == 0 or shadow_views is not views.shadows[number - 1])) or not views.share_shadows:
            self._geometry.fill_shadow_maps(self._shadows.framebuffers, shadow_views)
        mirrored = self._mirrored(mirror, offset_px, shadow_views, sample, time_s)
        self._fill(number, before, offset_px, occlusion=first or mirrored is not None or bool(views.lens))
        with self.timers.measure("light"):
            clouds = cloud_origin(self.scene, views.pictures[number].camera_ws, time_s)
            light = self._lighting.shade(self._gbuffer, self._shadows, shadow_views, sample, clouds)
        if self._water:
            with self.timers.measure("water"):
                light = self._water.cover(light, mirrored, self._gbuffer, time_s)
        if first and number == 0:
            with self.timers.measure("post"):
                self._blade_pixels.count(self._gbuffer)
        return light

    def _fill(
        self, number: int, before: Sequence[Moment], offset_px: tuple[float, float], *, occlusion: bool
    ) -> None:
        view = self._views.pictures[number]
        previous_view = before[number][0] if number < len(before) else view
        self._geometry.fill(self._gbuffer, view, previous_view, offset_px, slot=PICTURE, occlusion=occlusion)

    def _fill_with_water(self, face: int, before: Sequence[Moment], offset_px: tuple[float, float]) -> None:
        self._fill(face, before, offset_px, occlusion=True)
        if self._water:
            clouds = cloud_origin(self.scene, self._views.pictures[face].camera_ws, self._time_s)
            light = self._lighting.shade(self._gbuffer, self._shadows, self._views.shadows[face], 0, clouds)
            self._water.cover(light, None, self._gbuffer, self._time_s)

    def _truth(self, camera: Camera, aovs: Sequence[Aov], before: Sequence[Moment]) -> Truth:
        """Truth of the picture, of which the G-buffer holds the sample at the pixels' centres, and its camera."""
        lens = self._views.lens
        if lens:
            truth = lens.truth(
                lambda face, offset_px: self._fill_with_water(face, before, offset_px),
                lambda wanted: read_truth(self._gbuffer, wanted, self._geometry.identify),
                aovs,
            )
        else:
            truth = read_truth(self._gbuffer, aovs, self._geometry.identify)
        view_from_world, clip_from_view = self.camera_matrices(camera)
        record = camera_record(camera, clip_from_view @ view_from_world, view_from_world, self.size)
        return truth | {"camera": np.array(record)}

    def _mirrored(
        self,
        mirror: View | None,
        offset_px: tuple[float, float],
        shadow_views: Sequence[View],
        sample: int,
        time_s: float,
    ) -> moderngl.Texture | None:
        """Light of what the water mirrors, if it does."""
        water = self._water
        if not (water and mirror and water.gbuffer and water.lighting):
            return None
        self._geometry.fill(water.gbuffer, mirror, mirror, offset_px, slot=MIRROR, occlusion=True)
        with self.timers.measure("water"):
            clouds = cloud_origin(self.scene, mirror.camera_ws, time_s)
            return water.lighting.shade(water.gbuffer, self._shadows, shadow_views, sample, clouds)

    def _move(self, time_s: float, cameras: tuple[Camera, ...]) -> FrameTime:
        """Sow around the camera if need be, and move the grass on to an instant."""
        if not abs(time_s) <= _LONGEST_S:
            raise InputError(f"time: must be a finite number of seconds, at most a billion (got {time_s})")
        views = self._views_of(cameras)
        previous_s = self._moments[0][1] if self._moments else time_s - _FRAME_S
        frame_time = FrameTime(time_s, previous_s, views.every)
        for placed in self._placed.values():
            placed.arrive(time_s)
        self.timers.start_frame()
        with self._timed("sow"):
            self._world.follow(views.pictures[0].camera_ws)
        with self._timed("draw"), self.timers.measure("move"):
            self._world.move(frame_time)
        self._moments, self._time_s = tuple((view, time_s) for view in views.pictures), time_s
        return frame_time

    def _views_of(self, cameras: tuple[Camera, ...]) -> Views:
        """The views of cameras and their shadow maps; the same objects while neither cameras nor size change."""
        if self._views.cameras != cameras or self._views.size != self.size:
            heights = self._world.ground.heights
            lens = None if all(camera.is_straight for camera in cameras) else self._lens(cameras[0])
            if lens:
                pictures = lens.faces(cameras[0], heights)
            else:
                pictures = tuple(camera_view(camera, heights, self.size) for camera in cameras)
            shadows = tuple(self._shadows.views(view) for view in (pictures if lens else pictures[:1]))
            views = Views(
                cameras,
                self.size,
                pictures,
                shadows if lens else shadows * len(pictures),
                tuple(self._water.mirror(view) if self._water else None for view in pictures),
                tuple(itertools.chain.from_iterable(shadows)),
                lens,
            )
            # only now, as a camera may be refused until here
            with self._whole():
                self._fit(lens.face_size if lens else self.size)
            if lens is not self._views.lens:
                self._moments = ()  # of other pictures
            self._views = views
        return self._views

    def _lens(self, camera: Camera) -> Lens:
        if self.temporal:
            raise InputError(
                "camera: a lens that distorts and a fisheye are not for temporal pictures; average samples instead "
                "(samples=4, or animate --samples 4)"
            )
        if self._blur:
            raise InputError('post.blur: must be "off" for a lens that distorts and for a fisheye')
        key = lens_key(camera), self.size
        if self._latest_lens is None or self._latest_lens[0] != key:
            lens = Lens(self.device, camera, self.size, self._stage)
            if self._latest_lens:
                self._disown(self._latest_lens[1])
            self._latest_lens = key, self._own(lens)
        return self._latest_lens[1]

    def _check_size(self, size: tuple[int, int]) -> None:
        limit = self.device.limits.picture_px
        if len(size) != 2 or not all(map(is_whole, size)):
            raise InputError(f"size: must be two whole numbers of pixels (got {size!r})")
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
        with self._use():
            self._release_parts()
        self._released = True

    def __del__(self) -> None:
        # a notebook forgets renderers; their memory goes when the device is used next
        if not getattr(self, "_released", True):
            self.device.forget(self._parts)

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


def _refuse_damage(state: Mapping[str, Any]) -> None:
    """Raise `InputError` for what is no checkpoint, or one whose arrays hold numbers that no state has."""
    if "time_s" not in state:
        raise InputError("this is not a checkpoint of greensward")
    for name, array in state.items():
        kinds = "U" if name == "camera" else "biuf"
        sound = isinstance(array, np.ndarray) and array.dtype.kind in kinds
        if sound and array.dtype.kind == "f":
            sound = bool((np.abs(array) < np.float64(1e12)).all())
        if not sound or (name in ("time_s", "camera") and array.shape != ()):
            raise InputError(f"the checkpoint's {short(name, quoted=False)} is damaged")
