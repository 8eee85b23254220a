"""One picture of the window: a renderer that is good, and the next one while it is built beside it."""

import threading
import time
from dataclasses import dataclass, field

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.context import is_software
from greensward.renderer import Counts, Renderer
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.viewer.contexts import Contexts, Slot

Size = tuple[int, int]
_STRAY_M = 2.5  # sowing takes a CPU as long as a frame: not in every step of someone who walks


@dataclass
class _Made:
    """A renderer with its context and what it draws into; or why there is none."""

    scene: Scene
    slot: Slot
    size: Size
    renderer: Renderer | None = None
    colour: moderngl.Texture | None = None
    target: moderngl.Framebuffer | None = None
    problems: tuple[str, ...] = ()
    seconds: float = 0.0
    thread: threading.Thread | None = field(default=None, repr=False)

    def aim(self, size: Size) -> None:
        """Draw pictures of this size from now on; its context must be current."""
        if self.colour is not None and self.size == size:
            return
        ctx = self.slot.ctx
        if self.target is not None:
            self.free_target()
        self.target = self.colour = None  # where there is no memory for another
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
        """Draw a frame and wait for it; its context must be current."""
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


class Pane:
    """Shows the latest scene that can be drawn. What fails is told in `problems`, and the last good one goes on."""

    def __init__(self, contexts: Contexts) -> None:
        self._contexts = contexts
        self._good: _Made | None = None
        self._next: _Made | None = None
        self._wanted: Scene | None = None
        self._refused: Scene | None = None
        self._anew = self._waits = False
        self.problems: tuple[str, ...] = ()
        """Why the scene that was asked for is not the one that is shown."""
        self.took_ms = 0.0
        """Time of the last frame."""
        self.pass_ms: dict[str, float] = {}
        """Milliseconds of each pass of the last frame that was `timed`."""
        self.build_s = 0.0
        """Time that the last renderer took to build, its first frame included."""
        self.building_since: float | None = None
        self.blended = 0
        """Frames that the picture holds of the same instant and view."""
        self._last: tuple[object, ...] = ()
        self.software = is_software(contexts.ctx)

    @property
    def scene(self) -> Scene | None:
        """What is shown."""
        return self._good.scene if self._good else None

    @property
    def busy(self) -> bool:
        """Whether a renderer is being built, or about to be."""
        return self._next is not None or self._waits

    @property
    def renderer(self) -> Renderer | None:
        """Of the picture that is shown, for its counts and times; draw with `draw` only."""
        return self._good.renderer if self._good else None

    @property
    def picture(self) -> tuple[int, Size] | None:
        """OpenGL's name of the picture's texture, bottom row first, and its size."""
        good = self._good
        return (good.colour.glo, good.size) if good and good.colour else None

    def rebuild(self) -> None:
        """Build the renderer anew although its scene is the same: shaders or files have changed."""
        self._anew = True
        self._refused = None

    def show(self, scene: Scene, camera: Camera, time_s: float, size: Size) -> None:
        """Show a scene as soon as it can be drawn; call every frame."""
        # what is being dragged is built when the hand rests
        rests = self._good is None or scene == self._wanted
        self._wanted = scene
        self._take_over()
        needed = self._next is None and self._needs_building(scene)
        self._waits = needed and not rests
        if needed and rests:
            self._begin(scene, camera, time_s, size)

    def _needs_building(self, scene: Scene) -> bool:
        if self._anew:
            return True
        good = self._good
        if scene == self._refused:
            return False
        if good and scene == good.scene and same_folder(scene, good.scene):
            if self._refused is not None:
                self._refused, self.problems = None, ()
            return False
        if good and good.renderer:
            try:
                with self._contexts.within(good.slot):
                    changed = good.renderer.change(scene)
            except GreenswardError as error:
                self._refuse(scene, _told(error))
                return False
            except Exception as error:
                self._refuse(scene, (f"{type(error).__name__}: {error}",))
                return False
            if changed:
                good.scene, self.problems, self.blended = scene, (), 0
                return False
        return True

    def _refuse(self, scene: Scene, problems: tuple[str, ...]) -> None:
        self._refused, self.problems = scene, problems

    def _begin(self, scene: Scene, camera: Camera, time_s: float, size: Size) -> None:
        self._anew = False
        try:
            slot = self._contexts.take()
        except GreenswardError as error:
            self._refuse(scene, _told(error))
            return
        job = self._next = _Made(scene, slot, size)
        self.building_since = time.perf_counter()
        if job.slot.apart:
            job.thread = threading.Thread(target=self._build, args=(job, camera, time_s), daemon=True)
            job.thread.start()
        else:
            self._build(job, camera, time_s)

    def _build(self, job: _Made, camera: Camera, time_s: float) -> None:
        began = time.perf_counter()
        try:
            job.slot.enter()
            stray_m = _STRAY_M if self.software else None
            job.renderer = Renderer(job.scene, size=job.size, temporal=True, ctx=job.slot.ctx, stray_m=stray_m)
            size, job.size = job.size, (0, 0)
            job.aim(size)
            job.draw(camera, time_s)
        except GreenswardError as error:
            job.problems = _told(error)
        except Exception as error:  # a driver may raise anything, and the window must go on
            job.problems = (f"{type(error).__name__}: {error}",)
        finally:
            if job.problems:
                job.release()
                job.renderer = job.target = job.colour = None
            if job.slot.apart:
                self._contexts.leave()
        job.seconds = time.perf_counter() - began

    def _take_over(self) -> None:
        job = self._next
        if job is None or (job.thread is not None and job.thread.is_alive()):
            return
        self._next = self.building_since = None
        self.build_s = job.seconds
        if job.renderer is None:
            self._contexts.give_back(job.slot)
            self._refuse(job.scene, job.problems)
            return
        if self._good is not None:
            self._let_go(self._good)
        self._good, self.problems, self.blended, self._refused = job, (), 0, None
        self._last = ()

    def _let_go(self, made: _Made) -> None:
        with self._contexts.within(made.slot):
            made.release()
        self._contexts.give_back(made.slot)

    def draw(self, camera: Camera, time_s: float, size: Size, *, timed: bool = False) -> bool:
        """Draw a frame if it would differ from the last; returns whether it did."""
        good = self._good
        if good is None or good.renderer is None:
            return False
        now = (camera, time_s, size, good.scene)
        self.blended = self.blended + 1 if now == self._last else 0
        if self.blended > SETTLED:
            return False
        began = time.perf_counter()
        try:
            with self._contexts.within(good.slot):
                good.renderer.timers.enabled = timed
                good.aim(size)
                good.draw(camera, time_s)
                if timed:
                    self.pass_ms = good.renderer.timers.milliseconds()
        except GreenswardError as error:
            self.problems = _told(error)
        except Exception as error:
            self.problems = (f"{type(error).__name__}: {error}",)
        else:
            if self._refused is None:
                self.problems = ()
        self._last = now
        self.took_ms = 1e3 * (time.perf_counter() - began)
        return True

    @property
    def counts(self) -> Counts:
        """How many blades the last frame took."""
        if self._good is None or self._good.renderer is None:
            return Counts()
        with self._contexts.within(self._good.slot):
            return self._good.renderer.counts

    def read(self) -> npt.NDArray[np.uint8]:
        """The picture, (height, width, 3), top row first; black before there is one."""
        good = self._good
        if good is None or good.colour is None:
            return np.zeros((2, 2, 3), np.uint8)
        with self._contexts.within(good.slot):
            pixels = np.frombuffer(good.colour.read(), np.uint8).reshape(*good.size[::-1], 4)
        return pixels[::-1, :, :3].copy()

    def wait(self) -> None:
        """Let what is being built come to its end."""
        if self._next and self._next.thread:
            self._next.thread.join()

    def release(self) -> None:
        """Free everything, after what is being built."""
        self.wait()
        for made in (self._next, self._good):
            if made is not None:
                self._let_go(made)
        self._next = self._good = None


SETTLED = 24
"""Frames after which a still picture is clean, and is not drawn again."""


def same_folder(one: Scene, other: Scene) -> bool:
    """Whether the files that two scenes name are the same files."""
    return one.resolve(".") == other.resolve(".")


def _told(error: GreenswardError) -> tuple[str, ...]:
    return error.problems if isinstance(error, SceneError) else (str(error),)
