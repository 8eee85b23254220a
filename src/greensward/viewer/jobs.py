"""Work beside the window: pictures of any size, a video of what is seen, the way that was gone."""

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
_SAMPLES_A_SECOND = 10.0


class _StoppedError(Exception):
    """Someone no longer wants it."""


class PictureJob:
    """Draws one picture in a context of its own, in a thread of its own."""

    def __init__(
        self, scene: Scene, camera: Camera, time_s: float, path: Path, size: tuple[int, int], samples: int
    ) -> None:
        self.path = path
        self.done, self.total = 0, samples
        self.problem: str | None = None
        self._stopped = False
        self._thread = threading.Thread(target=self._draw, args=(scene, camera, time_s, size), daemon=True)
        self._thread.start()

    def _draw(self, scene: Scene, camera: Camera, time_s: float, size: tuple[int, int]) -> None:
        def tell(done: int, _total: int) -> None:
            self.done = done
            if self._stopped:
                raise _StoppedError

        try:
            with Renderer(scene, size=size, samples=self.total) as renderer:
                write_picture(self.path, renderer.render(time_s, camera=camera, progress=tell).image)
        except _StoppedError:
            pass
        except GreenswardError as error:
            self.problem = str(error)
        except Exception as error:  # a driver may raise anything, and the window must go on
            self.problem = f"{self.path}: {type(error).__name__}: {error}"

    @property
    def running(self) -> bool:
        """Whether it is not there yet."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Give up, and wait for that."""
        self._stopped = True
        self._thread.join()


class VideoJob:
    """Writes frames as they come, each as often as its time asks for."""

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        self.path = path
        # encoders want even edges
        self._size = size[0] // 2 * 2 or 2, size[1] // 2 * 2 or 2
        self._writer = VideoWriter(path, self._size, VIDEO_FPS)
        self._writer.__enter__()
        self.seconds = 0.0

    def add(self, pixels: Callable[[], Pixels], seconds: float) -> None:
        """So much time has passed, and this is what is seen now."""
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
        """Write its end."""
        try:
            if self._writer.frames:
                self._writer.finish()
        finally:
            self._writer.__exit__(None, None, None)

    def give_up(self) -> None:
        """End it without a file."""
        self._writer.__exit__(_StoppedError, None, None)


class PathRecorder:
    """Where the eye is, ten times a second."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.stations: list[tuple[float, Camera]] = []

    def add(self, camera: Camera, seconds: float) -> None:
        """So much time has passed, and this is seen now."""
        self.seconds += seconds if self.stations else 0.0
        if not self.stations or self.seconds - self.stations[-1][0] >= 1.0 / _SAMPLES_A_SECOND:
            self.stations.append((round(self.seconds, 3), camera))
