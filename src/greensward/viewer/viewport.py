"""Viewport: a renderer of the current scene, and its successor while that is built in the background."""

import threading
import time
from dataclasses import dataclass, field

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.adapters import is_software
from greensward.gpu.device import Device
from greensward.renderer import Counts, Renderer
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.viewer.contexts import Contexts, Slot

Size = tuple[int, int]


@dataclass
class _Build:
    """Renderer with its context and framebuffer, or the reasons for which it could not be built."""

    scene: Scene
    slot: Slot
    size: Size
    renderer: Renderer | None = None
    colour: moderngl.Texture | None = None
    target: moderngl.Framebuffer | None = None
    problems: tuple[str, ...] = ()
    seconds: float = 0.0
    thread: threading.Thread | None = field(default=None, repr=False)

    def resize(self, size: Size) -> None:
        """Set the size of the framebuffer; its context must be current."""
        if self.colour is not None and self.size == size:
            return
        ctx = self.slot.ctx
        if self.target is not None:
            self.free_target()
        self.target = self.colour = None  # in case there is no memory for another
        self.size = size
        self.colour = ctx.texture(size, 4)
        self.colour.filter = moderngl.LINEAR, moderngl.LINEAR
        self.colour.repeat_x = self.colour.repeat_y = False
        self._depth = ctx.depth_renderbuffer(size)
        self.target = ctx.framebuffer([self.colour], self._depth)

    def free_target(self) -> None:
        for part in (self.target, self.colour, self._depth):
            if part is not None:
                part.release()

    def draw(self, camera: Camera, time_s: float) -> None:
        """Draw a frame and wait for it; the context must be current."""
        assert self.renderer
        assert self.target
        self.target.clear(depth=1.0)
        self.renderer.draw(self.target, time_s, camera=camera)
        self.slot.ctx.finish()

    def release(self) -> None:
        if self.renderer is not None:
            self.renderer.release()
        if self.target is not None:
            self.free_target()


class Viewport:
    """Picture of the latest scene that can be drawn; `problems` say why a newer one cannot."""

    def __init__(self, contexts: Contexts) -> None:
        self._contexts = contexts
        self._current: _Build | None = None
        self._pending: _Build | None = None
        self._wanted: Scene | None = None
        self._failed: Scene | None = None
        self._rebuild = self._waiting = False
        self.problems: tuple[str, ...] = ()
        """Reasons for which the wanted scene is not shown."""
        self.took_ms = 0.0
        """Milliseconds of the last frame."""
        self.pass_ms: dict[str, float] = {}
        """Milliseconds by pass of the last frame that was `timed`."""
        self.build_s = 0.0
        """Seconds that the last renderer took to build, with its first frame."""
        self.building_since: float | None = None
        self.blended = 0
        """Frames of the same time and view that the picture has accumulated."""
        self._last: tuple[object, ...] = ()
        self.software = is_software(contexts.ctx)

    @property
    def scene(self) -> Scene | None:
        """Scene that is shown."""
        return self._current.scene if self._current else None

    @property
    def busy(self) -> bool:
        """True while a renderer is built or about to be."""
        return self._pending is not None or self._waiting

    @property
    def renderer(self) -> Renderer | None:
        """Renderer of the scene that is shown, for its figures; draw with `draw` only."""
        return self._current.renderer if self._current else None

    @property
    def picture(self) -> tuple[int, Size] | None:
        """OpenGL name of the picture's texture, bottom row first, and its size."""
        current = self._current
        return (current.colour.glo, current.size) if current and current.colour else None

    def rebuild(self) -> None:
        """Build a new renderer of the same scene, whose shaders or files have changed."""
        self._rebuild = True
        self._failed = None

    def show(self, scene: Scene, camera: Camera, time_s: float, size: Size) -> None:
        """Show a scene as soon as it can be drawn; call every frame."""
        # during a drag, wait until the value stays
        steady = self._current is None or scene == self._wanted
        self._wanted = scene
        self._finish_build()
        needed = self._pending is None and self._needs_building(scene)
        self._waiting = needed and not steady
        if needed and steady:
            self._start_build(scene, camera, time_s, size)

    def _needs_building(self, scene: Scene) -> bool:
        if self._rebuild:
            return True
        current = self._current
        if scene == self._failed:
            return False
        if current and scene == current.scene and scene.folder == current.scene.folder:
            if self._failed is not None:
                self._failed, self.problems = None, ()
            return False
        if current and current.renderer:
            try:
                with self._contexts.within(current.slot):
                    changed = current.renderer.updates_in_place(scene)
                    if changed:
                        current.renderer.update(scene)
            except GreenswardError as error:
                self._fail(scene, _sentences(error))
                return False
            except Exception as error:
                self._fail(scene, (f"{type(error).__name__}: {error}",))
                return False
            if changed:
                current.scene, self.problems, self.blended = scene, (), 0
                return False
        return True

    def _fail(self, scene: Scene, problems: tuple[str, ...]) -> None:
        self._failed, self.problems = scene, problems

    def _start_build(self, scene: Scene, camera: Camera, time_s: float, size: Size) -> None:
        self._rebuild = False
        try:
            slot = self._contexts.take()
        except GreenswardError as error:
            self._fail(scene, _sentences(error))
            return
        job = self._pending = _Build(scene, slot, size)
        self.building_since = time.perf_counter()
        if job.slot.separate:
            job.thread = threading.Thread(target=self._build, args=(job, camera, time_s), daemon=True)
            job.thread.start()
        else:
            self._build(job, camera, time_s)

    def _build(self, job: _Build, camera: Camera, time_s: float) -> None:
        began = time.perf_counter()
        try:
            job.slot.enter()
            # in a context of its own nobody else's state is there to be preserved
            device = Device.of(job.slot.ctx, preserve_state=not job.slot.separate)
            job.renderer = Renderer(
                job.scene,
                size=job.size,
                temporal=True,
                device=device,
            )
            size, job.size = job.size, (0, 0)
            job.resize(size)
            job.draw(camera, time_s)
        except GreenswardError as error:
            job.problems = _sentences(error)
        except Exception as error:  # a driver may raise anything, and the window must go on
            job.problems = (f"{type(error).__name__}: {error}",)
        finally:
            if job.problems:
                job.release()
                job.renderer = job.target = job.colour = None
            if job.slot.separate:
                self._contexts.leave()
        job.seconds = time.perf_counter() - began

    def _finish_build(self) -> None:
        job = self._pending
        if job is None or (job.thread is not None and job.thread.is_alive()):
            return
        self._pending = self.building_since = None
        self.build_s = job.seconds
        if job.renderer is None:
            self._contexts.give_back(job.slot)
            self._fail(job.scene, job.problems)
            return
        if self._current is not None:
            self._free(self._current)
        self._current, self.problems, self.blended, self._failed = job, (), 0, None
        self._last = ()

    def _free(self, build: _Build) -> None:
        with self._contexts.within(build.slot):
            build.release()
        self._contexts.give_back(build.slot)

    def draw(self, camera: Camera, time_s: float, size: Size, *, timed: bool = False) -> bool:
        """Draw a frame unless it would repeat the last; return True if it was drawn."""
        current = self._current
        if current is None or current.renderer is None:
            return False
        now = (camera, time_s, size, current.scene)
        self.blended = self.blended + 1 if now == self._last else 0
        if self.blended > SETTLED:
            return False
        began = time.perf_counter()
        try:
            with self._contexts.within(current.slot):
                current.renderer.timers.enabled = timed
                current.resize(size)
                current.draw(camera, time_s)
                if timed:
                    self.pass_ms = current.renderer.timers.milliseconds()
        except GreenswardError as error:
            self.problems = _sentences(error)
        except Exception as error:
            self.problems = (f"{type(error).__name__}: {error}",)
        else:
            if self._failed is None:
                self.problems = ()
        self._last = now
        self.took_ms = 1e3 * (time.perf_counter() - began)
        return True

    @property
    def counts(self) -> Counts:
        """Numbers of blades of the last frame."""
        if self._current is None or self._current.renderer is None:
            return Counts()
        with self._contexts.within(self._current.slot):
            return self._current.renderer.counts

    def read(self) -> npt.NDArray[np.uint8]:
        """Return the picture, (height, width, 3), top row first; black before the first."""
        current = self._current
        if current is None or current.colour is None:
            return np.zeros((2, 2, 3), np.uint8)
        with self._contexts.within(current.slot):
            pixels = np.frombuffer(current.colour.read(), np.uint8).reshape(*current.size[::-1], 4)
        return pixels[::-1, :, :3].copy()

    def wait(self) -> None:
        """Wait for the renderer that is being built."""
        if self._pending and self._pending.thread:
            self._pending.thread.join()

    def release(self) -> None:
        """Free the GPU resources, after a renderer that is being built."""
        self.wait()
        for build in (self._pending, self._current):
            if build is not None:
                self._free(build)
        self._pending = self._current = None


SETTLED = 24
"""Frames after which a still picture has converged, and is not drawn again."""


def _sentences(error: GreenswardError) -> tuple[str, ...]:
    return error.problems if isinstance(error, SceneError) else (str(error),)
