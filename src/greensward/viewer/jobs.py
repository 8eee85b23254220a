"""Recordings and renderings beside the window: pictures of any size, a video of the viewport, a camera path."""

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.io.rasters import write_picture
from greensward.io.video import VideoWriter
from greensward.renderer import Renderer
from greensward.scene import Camera, GreenswardError, Scene

Pixels = npt.NDArray[np.uint8]
VIDEO_FPS = 30.0
_SAMPLES_PER_SECOND = 10.0


class _CancelledError(Exception):
    """Cancellation by the user."""


class PictureJob:
    """Rendering of one picture, in a context and a thread of its own."""

    def __init__(
        self, scene: Scene, camera: Camera, time_s: float, path: Path, size: tuple[int, int], samples: int
    ) -> None:
        self.path = path
        self.done, self.total = 0, samples
        self.problem: str | None = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._render, args=(scene, camera, time_s, size), daemon=True)
        self._thread.start()

    def _render(self, scene: Scene, camera: Camera, time_s: float, size: tuple[int, int]) -> None:
        def progress(done: int, _total: int) -> None:
            self.done = done
            if self._cancelled:
                raise _CancelledError

        try:
            with Renderer(scene, size=size, samples=self.total) as renderer:
                write_picture(self.path, renderer.render(time_s, camera=camera, progress=progress).image)
        except _CancelledError:
            pass
        except GreenswardError as error:
            self.problem = str(error)
        except Exception as error:  # a driver may raise anything, and the window must go on
            self.problem = f"{self.path}: {type(error).__name__}: {error}"

    @property
    def running(self) -> bool:
        """True until the picture is written or has failed."""
        return self._thread.is_alive()

    def cancel(self) -> None:
        """Cancel the rendering, and wait for its thread."""
        self._cancelled = True
        self._thread.join()


class VideoJob:
    """Recording of frames at a fixed rate: each is repeated or dropped as the time since the last one asks for."""

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        self.path = path
        # encoders want even edges
        self._size = size[0] // 2 * 2 or 2, size[1] // 2 * 2 or 2
        self._writer = VideoWriter(path, self._size, VIDEO_FPS)
        self._writer.__enter__()
        self.seconds = 0.0

    def add(self, pixels: Callable[[], Pixels], seconds: float) -> None:
        """Add a frame after this many seconds; `pixels` reads it if it is needed."""
        self.seconds += seconds
        due = int(self.seconds * VIDEO_FPS) - self._writer.frames
        if due <= 0:
            return
        frame = pixels()
        if frame.shape[1::-1] != self._size:
            frame = np.asarray(Image.fromarray(frame).resize(self._size, Image.Resampling.BILINEAR))
        for _ in range(min(due, 30)):
            self._writer.add(frame)

    def finish(self) -> None:
        """Complete the file."""
        try:
            if self._writer.frames:
                self._writer.finish()
        finally:
            self._writer.__exit__(None, None, None)

    def cancel(self) -> None:
        """End the recording without a file."""
        self._writer.__exit__(_CancelledError, None, None)


class PathRecording:
    """Recording of the camera, ten times a second."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.stations: list[tuple[float, Camera]] = []

    def add(self, camera: Camera, seconds: float) -> None:
        """Add the camera after this many seconds."""
        self.seconds += seconds if self.stations else 0.0
        if not self.stations or self.seconds - self.stations[-1][0] >= 1.0 / _SAMPLES_PER_SECOND:
            self.stations.append((round(self.seconds, 3), camera))
