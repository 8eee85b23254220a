"""The widget that a notebook shows; the only place that knows how a notebook is told of frames and tells of keys."""

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
from greensward.scene import GreenswardError, Scene, TechniqueChoice
from greensward.viewer.obstacles import Obstacles
from greensward.viewer.walker import Intent, Walker

if TYPE_CHECKING:
    from greensward.renderer import Renderer

_WAYS = {
    "w": (1, 0, 0), "arrowup": (1, 0, 0), "s": (-1, 0, 0), "arrowdown": (-1, 0, 0),
    "d": (0, 1, 0), "arrowright": (0, 1, 0), "a": (0, -1, 0), "arrowleft": (0, -1, 0),
    "e": (0, 0, 1), "q": (0, 0, -1),
}  # fmt: skip
_P = ParamSpec("_P")
_R = TypeVar("_R")
_LEFT = 1
_ZOOM_PER_PX = 0.001
_SETTLED = 16
"""Frames after which a picture that rests is clean."""
_SLOW_S, _QUICK_S = 0.12, 0.04
_SCALES = (1.0, 0.7, 0.5)
_LARGEST_PX = 4096
_LONGEST_STEP_S = 0.25  # the grass waits for frames that take longer, and pictures blend

# kernels call from one thread now and from another then, and a context can be current in one only
_drawing = ThreadPoolExecutor(1, "greensward-views")
_no_longer_seen: deque["Renderer"] = deque()


def _there(job: Callable[_P, _R], *args: _P.args, **kwargs: _P.kwargs) -> _R:
    """What a job gives that is done in the thread that draws, one after the other."""
    _drawing.submit(_release)
    return _drawing.submit(job, *args, **kwargs).result()


def _release() -> None:
    while _no_longer_seen:
        _no_longer_seen.popleft().release()


class SceneView(RemoteFrameBuffer):  # type: ignore[misc]
    """A scene in a notebook, drawn headless and looked about in; `greensward.show` makes one, and tells its keys.

    It draws only while it is seen and something moves, and `close` frees the GPU.
    """

    _renderer: "Renderer | None" = None

    def __init__(
        self, scene: Scene, *, time_s: float = 0.0, playing: bool = True, size: tuple[int, int], device: str = "auto"
    ) -> None:
        super().__init__(css_width=f"{size[0]}px", css_height=f"{size[1]}px", title=scene.title or "greensward")
        self._scene, self._device, self._size, self._scale = scene, device, size, 0
        self._held: set[str] = set()
        self._pointer: tuple[float, float] | None = None
        self._circles = False
        self._drawn_at: float | None = None
        self._playing = playing
        self._time_s = time_s
        self._rested = 0
        try:
            heights = HeightField.of(scene)
            self._renderer = _there(self._made)
            self.eye = Walker(scene.camera, heights)
            self.eye.enter(heights, Obstacles.of(scene, heights), scene.water.level_m if scene.water else -math.inf)
        except BaseException:
            self.close()
            raise

    def _made(self) -> "Renderer":
        from greensward.renderer import Renderer

        return Renderer(self._scene, size=self._pixels(self._playing), temporal=True, device=self._device)

    @property
    def technique(self) -> str:
        """What draws the grass; another one may be named at any time."""
        return self._scene.technique.name

    @technique.setter
    def technique(self, name: str) -> None:
        _there(self._switch, name)
        self.request_draw()

    def _switch(self, name: str) -> None:
        before, kept = self._scene, self._renderer
        if kept is None:  # closed
            return
        self._scene = before.model_copy(update={"technique": TechniqueChoice(name=name)})
        try:
            self._renderer = self._made()
        except GreenswardError:
            self._scene = before
            raise
        self._rested = 0
        kept.release()

    @property
    def time_s(self) -> float:
        """The instant that is shown."""
        return self._time_s

    @time_s.setter
    def time_s(self, time_s: float) -> None:
        self._time_s, self._rested = time_s, 0
        self.request_draw()

    @property
    def playing(self) -> bool:
        """Whether time goes on."""
        return self._playing

    @playing.setter
    def playing(self, plays: bool) -> None:
        self._playing, self._rested = plays, 0
        self.request_draw()

    def get_frame(self) -> npt.NDArray[np.uint8] | None:
        """Draw the next frame: sRGB, (height, width, 3)."""
        if self._renderer is None:
            return None
        try:
            image, goes_on = _there(self._draw)
        except GreenswardError as error:
            self._playing = False
            self.print(error)
            return None
        if goes_on:
            self.request_draw()
        return image

    def _draw(self) -> tuple[npt.NDArray[np.uint8] | None, bool]:
        """The picture, and whether the next one will be another."""
        renderer = self._renderer
        if renderer is None:  # closed meanwhile
            return None, False
        began = time.perf_counter()
        goes = self._go_on(0.0 if self._drawn_at is None else min(began - self._drawn_at, _LONGEST_STEP_S))
        moves = goes or self._playing or self._pointer is not None or any(key in _WAYS for key in self._held)
        renderer.resize(self._pixels(moves))
        image = renderer.render(self._time_s, camera=self.eye.camera()).image
        if moves:
            self._suit(time.perf_counter() - began)
        self._rested = 0 if moves else self._rested + 1
        goes_on = moves or self._rested < _SETTLED
        self._drawn_at = began if goes_on else None
        return image, goes_on

    def _drag(self, event: dict[str, Any]) -> None:
        assert self._pointer
        right, down = event["x"] - self._pointer[0], event["y"] - self._pointer[1]
        self._pointer = event["x"], event["y"]
        if self._circles or self.eye.mode == "orbit":
            self.eye.circle((right, down))
        else:
            self.eye.move(Intent(turn_px=(-right, -down)), 0.0)

    def _leave(self) -> None:
        """Hand the renderer over to be released; waits for nothing, as memory may be collected at any time."""
        if self._renderer:
            _no_longer_seen.append(self._renderer)
            self._renderer = None

    def __del__(self) -> None:
        self._leave()
        super().__del__()

    def _go_on(self, seconds: float) -> bool:
        """Whether the eye is somewhere else then."""
        if self._playing:
            self._time_s += seconds
        ways = [(0, 0, 0), *(_WAYS[key] for key in self._held if key in _WAYS)]
        ahead, right, up = (sum(part) for part in zip(*ways, strict=True))
        return self.eye.move(Intent(ahead, right, up, fast="shift" in self._held), seconds)

    def _suit(self, lasted_s: float) -> None:
        """Fewer pixels where frames take long."""
        if lasted_s > _SLOW_S:
            self._scale = min(self._scale + 1, len(_SCALES) - 1)
        elif lasted_s < _QUICK_S:
            self._scale = max(self._scale - 1, 0)

    def _pixels(self, moves: bool) -> tuple[int, int]:
        scale = _SCALES[self._scale] if moves else 1.0
        width, height = (min(max(round(side * scale), 1), _LARGEST_PX) for side in self._size)
        return width, height

    def handle_event(self, event: dict[str, Any]) -> None:
        """What the browser tells of mouse, keys and size."""
        if event["type"] == "close":
            if self._renderer:
                self._leave()
                _drawing.submit(_release)
        elif self._renderer is not None and _there(self._told, event):
            self.request_draw()

    def _told(self, event: dict[str, Any]) -> bool:
        """Take up an event; whether it is one that changes anything."""
        self._rested = 0
        match event["type"]:
            case "resize" if event["width"] > 0 and event["height"] > 0:
                ratio = event.get("ratio", 1.0)
                self._size = round(event["width"] * ratio), round(event["height"] * ratio)
            case "pointer_down":
                self._pointer, self._circles = (event["x"], event["y"]), event["button"] != _LEFT
                self.eye.hold()
            case "pointer_up":
                self._pointer = None
            case "pointer_move" if self._pointer is not None:
                self._drag(event)
            case "wheel":
                self.eye.zoom(math.exp(_ZOOM_PER_PX * min(max(event["dy"], -500.0), 500.0)))
            case "key_down" if event["key"] == " ":
                self._playing = not self._playing
            case "key_down":
                self._held.add(event["key"].lower())
            case "key_up":
                self._held.discard(event["key"].lower())
            case "pointer_leave":
                self._held.clear()  # a key that is let go elsewhere is not heard of
            case _:
                return False
        return True
