"""Temporal anti-aliasing: each frame's one sample is blended into the history, reprojected along its motion."""

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.kernels import Bindings
from greensward.gpu.view import View
from greensward.scene import InputError

Moment = tuple[View, float]
"""View and time of a frame."""

_MOST_FRAMES = 2**31
_CUT_TURN_DEG, _CUT_MOVE_M, _CUT_ZOOM, _CUT_S = 30.0, 3.0, 1.5, 0.5


def is_cut(before: Moment, now: Moment) -> bool:
    """Return whether two frames that follow each other do not show one motion.

    They do not where the camera turned by more than 30°, moved by more than 3 m, or zoomed to more than one and a
    half times or less than two thirds, or where time went backwards or on by more than half a second.
    """
    (view, time_s), (next_view, next_time_s) = before, now
    turn = float(min(view.axis_ws[:3] @ next_view.axis_ws[:3], _up(view) @ _up(next_view)))
    move_m = float(np.linalg.norm(next_view.camera_ws - view.camera_ws))
    zoom = sum(next_view.pixel_m) / sum(view.pixel_m)
    return view.is_parallel != next_view.is_parallel or not (
        turn >= np.cos(np.radians(_CUT_TURN_DEG))
        and move_m <= _CUT_MOVE_M
        and 1.0 / _CUT_ZOOM <= zoom <= _CUT_ZOOM
        and 0.0 <= next_time_s - time_s <= _CUT_S
    )


def _up(view: View) -> npt.NDArray[np.float64]:
    up: npt.NDArray[np.float64] = (view.starts_ws if view.is_parallel else view.rays_ws)[2]
    return up / np.linalg.norm(up)


class Temporal:
    """History of a moving picture."""

    def __init__(self, device: Device, bindings: Bindings, size: tuple[int, int], stage: Stage | None) -> None:
        self._ctx, self._of_radiance = device.ctx, False
        self._pass = FullScreenPass(device, "passes/temporal/temporal.glsl", ["f2"], stage=stage, bindings=bindings)
        self._allocate(size)

    def _allocate(self, size: tuple[int, int]) -> None:
        # half floats: their steps are finer than those of the picture, also in the dark
        self._history, self._target = (self._ctx.texture(size, 4, dtype="f2") for _ in range(2))
        for texture in (self._history, self._target):
            texture.repeat_x = texture.repeat_y = False
        self._index = -1
        self._holds: Moment | None = None

    @property
    def frames(self) -> int:
        """Frames that the history holds, since it began or the last cut."""
        return self._index + 1

    def follow(self, before: Moment | None, now: Moment, encoding: str = "srgb") -> int:
        """Number of the frame that is to be drawn; 0 where the history does not lead to it.

        Its motion counts from the moment `before`, so the history must be of that one, in numbers of one encoding,
        and no cut between.
        """
        leads = before is not None and before == self._holds and not is_cut(before, now)
        # sRGB is made of linear numbers afterwards
        radiance, self._of_radiance = self._of_radiance, encoding == "hdr"
        leads = leads and radiance == self._of_radiance
        self._index = self._index + 1 if leads else 0
        self._holds = None  # until the frame is drawn
        return self._index

    def blend(self, latest: moderngl.Texture, now: Moment) -> moderngl.Texture:
        """Blend this frame, toned, into the history, which it becomes."""
        self._pass.run(self._target, latest=latest, history=self._history)
        self._history, self._target = self._target, self._history
        self._holds = now
        return self._history

    def saved(self) -> dict[str, npt.NDArray[Any]]:
        """Read back the history as arrays: colours and counts, (height, width, 4) float16, bottom row first."""
        if self._holds is None:
            return {}
        width, height = self._history.size
        history = np.frombuffer(self._history.read(), np.float16).reshape(height, width, 4)
        return {"history": history, "history_frames": np.array(self.frames)}

    def resume(self, saved: Mapping[str, npt.NDArray[Any]], moment: Moment) -> None:
        """Continue from what `saved` returned of a moment, if it was of pictures of this size, or begin anew."""
        history, frames = saved.get("history"), saved.get("history_frames")
        width, height = self._history.size
        self._index, self._holds = -1, None
        if history is not None and frames is not None and history.shape == (height, width, 4):
            if frames.shape != () or not 1 <= float(frames) < _MOST_FRAMES:
                raise InputError("the checkpoint's history_frames is damaged")
            self._history.write(np.ascontiguousarray(history, np.float16))
            self._index, self._holds = int(frames) - 1, moment

    def resize(self, size: tuple[int, int]) -> None:
        """Blend pictures of another size from now on, without those before."""
        self._free()
        self._allocate(size)

    def _free(self) -> None:
        self._history.release()
        self._target.release()

    def release(self) -> None:
        """Free the GPU resources."""
        self._free()
        self._pass.release()
