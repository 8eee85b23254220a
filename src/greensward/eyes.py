"""Eyes of a host: windows of its framebuffers, its cameras, and the views of a frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.device import Device
from greensward.gpu.view import View
from greensward.lens import Lens
from greensward.passes.post.window import DepthScale, Window
from greensward.scene import Camera, InputError
from greensward.viewpoint import camera_from_matrices, depth_row


@dataclass(frozen=True)
class Eye:
    """One of several pictures of an instant: where `draw_eyes` draws it, and from where it is seen."""

    framebuffer: moderngl.Framebuffer
    camera: Camera | None = None
    """The scene's, if neither it nor the two matrices are given."""
    view_from_world: npt.ArrayLike | None = None
    """(4, 4), for column vectors."""
    clip_from_view: npt.ArrayLike | None = None
    """(4, 4), for column vectors."""
    viewport: tuple[int, int, int, int] | None = None
    """Left, bottom, width and height in the framebuffer; by default its viewport."""
    layer: int | None = None
    """Layer of the framebuffer's attachments, if they have any."""


@dataclass(frozen=True)
class Views:
    """Views of a frame."""

    cameras: tuple[Camera, ...] = ()
    size: tuple[int, int] = (0, 0)
    pictures: tuple[View, ...] = ()
    """One for each camera, or one for each face of a lens."""
    shadows: tuple[tuple[View, ...], ...] = ()
    """Views of the shadow maps for each of them; pictures may share one tuple."""
    mirrors: tuple[View | None, ...] = ()
    """Views of what the water mirrors, for each of them."""
    lit: tuple[View, ...] = ()
    """All views of shadow maps."""
    lens: Lens | None = None

    @cached_property
    def share_shadows(self) -> bool:
        """True if all pictures are lit by the same maps."""
        return all(each is self.shadows[0] for each in self.shadows)

    @cached_property
    def every(self) -> tuple[View, ...]:
        """All that grass is culled for."""
        return (*self.pictures, *self.lit, *(mirror for mirror in self.mirrors if mirror))


def camera_of(
    camera: Camera,
    view_from_world: npt.ArrayLike | None,
    clip_from_view: npt.ArrayLike | None,
    size_px: tuple[int, int],
    chosen: bool,
    *,
    zero_to_one: bool = False,
) -> Camera:
    """The camera, or that of a host's matrices if it gives them. Raises `InputError` for both, if it was `chosen`."""
    if view_from_world is None and clip_from_view is None:
        return camera
    if view_from_world is None or clip_from_view is None or chosen:
        raise InputError("give either camera, or both view_from_world and clip_from_view")
    return camera_from_matrices(view_from_world, clip_from_view, size_px, zero_to_one=zero_to_one)


def windows_of(device: Device, eyes: Sequence[Eye], usual: Camera) -> list[tuple[Window, Camera]]:
    """The window that each eye's picture is drawn into, and the camera that sees it; without one, the `usual`.

    Raises `InputError` for a framebuffer that is none or is of another context, viewports of several sizes, and what
    is no camera.
    """
    if not eyes:
        raise InputError("eyes: must hold one at least (got none)")
    for eye in eyes:
        _refuse_foreign(device, eye.framebuffer)
    windows = [_window_of(device, eye, usual) for eye in eyes]
    sizes = {window.viewport[2:] for window, _ in windows}
    if len(sizes) != 1:
        raise InputError(f"viewport: must be of one size for all eyes (got {sorted(sizes)})")
    return windows


def _refuse_foreign(device: Device, framebuffer: Any) -> None:
    if not isinstance(framebuffer, moderngl.Framebuffer):
        raise InputError(
            f"framebuffer: must be a moderngl.Framebuffer (got {type(framebuffer).__name__}); "
            "ctx.detect_framebuffer() finds one that another library made"
        )
    if framebuffer.ctx is not device.ctx:
        raise InputError(
            "framebuffer: must be of the context that the renderer draws with: make it with "
            "Renderer(…, ctx=ctx), where ctx is the framebuffer's"
        )


def _window_of(device: Device, eye: Eye, usual: Camera) -> tuple[Window, Camera]:
    viewport, zero_to_one, depth_range = device.drawing_into(eye.framebuffer)
    viewport = viewport if eye.viewport is None else eye.viewport
    size = viewport[2:]
    if min(size) < 1:
        return Window(eye.framebuffer, (*viewport[:2], 0, 0), DepthScale(0.0, 0.0, False)), usual
    camera = camera_of(
        eye.camera or usual,
        eye.view_from_world,
        eye.clip_from_view,
        size,
        eye.camera is not None,
        zero_to_one=zero_to_one,
    )
    if not camera.is_straight:
        raise InputError("camera: a lens that distorts and a fisheye are for render (got them in draw)")
    own = eye.clip_from_view is None
    parallel = camera.projection == "orthographic"
    if own:
        a, b = depth_row(camera.near_m, camera.far_m, parallel=parallel)
    else:
        clip_from_view = np.asarray(eye.clip_from_view, np.float64)
        a, b = clip_from_view[2, 2:] / (clip_from_view[3, 3] if parallel else -clip_from_view[3, 2])
    depth = DepthScale.of(
        float(a),
        float(b),
        parallel=parallel,
        zero_to_one=zero_to_one and not own,
        depth_range=depth_range,
        behind_m=0.0 if own else _behind_m(camera, eye.view_from_world),
    )
    return Window(eye.framebuffer, viewport, depth, eye.layer), camera


def _behind_m(camera: Camera, view_from_world: Any) -> float:
    """Distance of a camera behind the pose that it was made from."""
    pose = np.asarray(view_from_world, np.float64)
    return float(pose[2, :3] @ (np.array(camera.position_m) + pose[:3, :3].T @ pose[:3, 3]))
