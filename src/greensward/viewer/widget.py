"""Notebook widget; the only module that knows how a notebook receives frames and sends events."""

import math
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt
from jupyter_rfb import RemoteFrameBuffer

from greensward.ground import HeightField
from greensward.scene import Camera, GreenswardError, Scene, TechniqueChoice
from greensward.viewer.camera_controller import CameraController, Intent
from greensward.viewer.obstacles import Obstacles

if TYPE_CHECKING:
    from greensward.renderer import Renderer

_KEYS = {
    "w": (1, 0, 0), "arrowup": (1, 0, 0), "s": (-1, 0, 0), "arrowdown": (-1, 0, 0),
    "d": (0, 1, 0), "arrowright": (0, 1, 0), "a": (0, -1, 0), "arrowleft": (0, -1, 0),
    "e": (0, 0, 1), "q": (0, 0, -1),
}  # fmt: skip
_P = ParamSpec("_P")
_R = TypeVar("_R")
_LEFT = 1
_ZOOM_PER_PX = 0.001
_SETTLED = 16
"""Frames after which a still picture has converged."""
_SLOW_S, _FAST_S = 0.12, 0.04
_SCALES = (1.0, 0.7, 0.5)
_LARGEST_PX = 4096
_LONGEST_STEP_S = 0.25  # longer frames slow the scene down, as pictures are blended

# kernels call from changing threads, and a context can be current in one thread only
_drawing = ThreadPoolExecutor(1, "greensward-views")
_unused: deque["Renderer"] = deque()


def _in_drawing_thread(job: Callable[_P, _R], *args: _P.args, **kwargs: _P.kwargs) -> _R:
    """Run a job in the thread that draws, and return its result."""
    _drawing.submit(_release_unused)
    return _drawing.submit(job, *args, **kwargs).result()


def _release_unused() -> None:
    while _unused:
        _unused.popleft().release()


class SceneView(RemoteFrameBuffer):  # type: ignore[misc]
    """Interactive view of a scene, rendered headless; see `greensward.show`.

    It draws only while it is visible and something moves; `close` frees the GPU.
    """

    _renderer: "Renderer | None" = None

    def __init__(
        self, scene: Scene, *, time_s: float = 0.0, playing: bool = True, size: tuple[int, int], device: str = "auto"
    ) -> None:
        super().__init__(css_width=f"{size[0]}px", css_height=f"{size[1]}px", title=scene.title or "greensward")
        self._scene, self._device, self._size, self._scale = scene, device, size, 0
        self._held: set[str] = set()
        self._pointer: tuple[float, float] | None = None
        self._orbiting = False
        self._drawn_at: float | None = None
        self._playing = playing
        self._time_s = time_s
        self._still_frames = 0
        try:
            heights = HeightField.of(scene)
            self._renderer = _in_drawing_thread(self._new_renderer)
            self.controller = CameraController(scene.camera, heights)
            self.controller.set_world(
                heights, Obstacles.of(scene, heights), scene.water.level_m if scene.water else -math.inf
            )
        except BaseException:
            self.close()
            raise

    def _new_renderer(self) -> "Renderer":
        from greensward.renderer import Renderer

        return Renderer(self._scene, size=self._pixels(self._playing), temporal=True, device=self._device)

    @property
    def technique(self) -> str:
        """Name of the technique; may be set at any time."""
        return self._scene.technique.name

    @technique.setter
    def technique(self, name: str) -> None:
        _in_drawing_thread(self._switch, name)
        self.request_draw()

    def _switch(self, name: str) -> None:
        before, renderer = self._scene, self._renderer
        if renderer is None:  # closed
            return
        self._scene = before.model_copy(update={"technique": TechniqueChoice(name=name)})
        try:
            self._renderer = self._new_renderer()
        except GreenswardError:
            self._scene = before
            raise
        self._still_frames = 0
        renderer.release()

    @property
    def camera(self) -> Camera:
        """Current camera."""
        return self.controller.camera()

    @property
    def time_s(self) -> float:
        """Scene time in seconds; may be set at any time."""
        return self._time_s

    @time_s.setter
    def time_s(self, time_s: float) -> None:
        self._time_s, self._still_frames = time_s, 0
        self.request_draw()

    @property
    def playing(self) -> bool:
        """True while time runs; may be set at any time."""
        return self._playing

    @playing.setter
    def playing(self, playing: bool) -> None:
        self._playing, self._still_frames = playing, 0
        self.request_draw()

    def get_frame(self) -> npt.NDArray[np.uint8] | None:
        """Draw the next frame: sRGB, (height, width, 3)."""
        if self._renderer is None:
            return None
        try:
            image, unfinished = _in_drawing_thread(self._draw)
        except GreenswardError as error:
            self._playing = False
            self.print(error)
            return None
        if unfinished:
            self.request_draw()
        return image

    def _draw(self) -> tuple[npt.NDArray[np.uint8] | None, bool]:
        """Return the picture, and True if the next one will differ."""
        renderer = self._renderer
        if renderer is None:  # closed meanwhile
            return None, False
        began = time.perf_counter()
        moved = self._advance(0.0 if self._drawn_at is None else min(began - self._drawn_at, _LONGEST_STEP_S))
        moving = moved or self._playing or self._pointer is not None or any(key in _KEYS for key in self._held)
        renderer.resize(self._pixels(moving))
        image = renderer.render(self._time_s, camera=self.controller.camera()).image
        if moving:
            self._adapt_scale(time.perf_counter() - began)
        self._still_frames = 0 if moving else self._still_frames + 1
        unfinished = moving or self._still_frames < _SETTLED
        self._drawn_at = began if unfinished else None
        return image, unfinished

    def _drag(self, event: dict[str, Any]) -> None:
        assert self._pointer
        right, down = event["x"] - self._pointer[0], event["y"] - self._pointer[1]
        self._pointer = event["x"], event["y"]
        if self._orbiting or self.controller.mode == "orbit":
            self.controller.orbit((right, down))
        else:
            self.controller.move(Intent(turn_px=(-right, -down)), 0.0)

    def _discard(self) -> None:
        """Queue the renderer for release, without waiting, as garbage may be collected at any time."""
        if self._renderer:
            _unused.append(self._renderer)
            self._renderer = None

    def __del__(self) -> None:
        self._discard()
        super().__del__()

    def _advance(self, seconds: float) -> bool:
        """Advance time and camera; return True if the camera changed."""
        if self._playing:
            self._time_s += seconds
        directions = [(0, 0, 0), *(_KEYS[key] for key in self._held if key in _KEYS)]
        ahead, right, up = (sum(part) for part in zip(*directions, strict=True))
        return self.controller.move(Intent(ahead, right, up, fast="shift" in self._held), seconds)

    def _adapt_scale(self, took_s: float) -> None:
        """Lower the resolution if frames take long."""
        if took_s > _SLOW_S:
            self._scale = min(self._scale + 1, len(_SCALES) - 1)
        elif took_s < _FAST_S:
            self._scale = max(self._scale - 1, 0)

    def _pixels(self, moving: bool) -> tuple[int, int]:
        scale = _SCALES[self._scale] if moving else 1.0
        width, height = (min(max(round(side * scale), 1), _LARGEST_PX) for side in self._size)
        return width, height

    def handle_event(self, event: dict[str, Any]) -> None:
        """Handle an event of the browser: mouse, key or size."""
        if event["type"] == "close":
            if self._renderer:
                self._discard()
                _drawing.submit(_release_unused)
        elif self._renderer is not None and _in_drawing_thread(self._handle, event):
            self.request_draw()

    def _handle(self, event: dict[str, Any]) -> bool:
        """Handle an event in the drawing thread; return True if it changes the picture."""
        self._still_frames = 0
        match event["type"]:
            case "resize" if event["width"] > 0 and event["height"] > 0:
                ratio = event.get("ratio", 1.0)
                self._size = round(event["width"] * ratio), round(event["height"] * ratio)
            case "pointer_down":
                self._pointer, self._orbiting = (event["x"], event["y"]), event["button"] != _LEFT
                self.controller.set_pivot()
            case "pointer_up":
                self._pointer = None
            case "pointer_move" if self._pointer is not None:
                self._drag(event)
            case "wheel":
                self.controller.zoom(math.exp(_ZOOM_PER_PX * min(max(event["dy"], -500.0), 500.0)))
            case "key_down" if event["key"] == " ":
                self._playing = not self._playing
            case "key_down":
                self._held.add(event["key"].lower())
            case "key_up":
                self._held.discard(event["key"].lower())
            case "pointer_leave":
                self._held.clear()  # the release of a key elsewhere is not reported
            case _:
                return False
        return True
