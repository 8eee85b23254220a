"""Eyes of a host: windows of its framebuffers, its cameras, and the views of a frame."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from operator import index
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

Viewport = tuple[int, int, int, int]


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


def is_whole(value: Any) -> bool:
    """Return whether a value is a whole number, NumPy's too."""
    return hasattr(value, "__index__") and not isinstance(value, bool)


def camera_of(
    camera: Camera | None,
    usual: Camera,
    view_from_world: npt.ArrayLike | None,
    clip_from_view: npt.ArrayLike | None,
    size_px: tuple[int, int],
    *,
    zero_to_one: bool = False,
) -> Camera:
    """The camera that a host gives, or that of its matrices, or the `usual`. Raises `InputError` for several."""
    if camera is not None and not isinstance(camera, Camera):
        raise InputError(f"camera: must be a gs.Camera (got {type(camera).__name__})")
    if view_from_world is None and clip_from_view is None:
        return usual if camera is None else camera
    if view_from_world is None or clip_from_view is None or camera is not None:
        raise InputError("give either camera, or both view_from_world and clip_from_view")
    return camera_from_matrices(view_from_world, clip_from_view, size_px, zero_to_one=zero_to_one)


def windows_of(device: Device, eyes: Iterable[Eye], usual: Camera) -> list[tuple[Window, Camera]]:
    """The window that each eye's picture is drawn into, and the camera that sees it; without one, the `usual`.

    Windows without area are left out. Raises `InputError` for a framebuffer that is none or is of another context,
    viewports of several sizes, a layer that there is not, and what is no camera.
    """
    listed = list(eyes) if isinstance(eyes, Iterable) else [eyes]
    if not listed:
        raise InputError("eyes: must hold one at least (got none)")
    for eye in listed:
        if not isinstance(eye, Eye):
            raise InputError(f"eyes: must be a list of gs.Eye (got {type(eye).__name__})")
        _refuse_foreign(device, eye.framebuffer)
        _refuse_layer(eye.framebuffer, eye.layer)
    placed = [(eye, _viewport_of(eye)) for eye in listed]
    windows = [_window_of(device, eye, viewport, usual) for eye, viewport in placed]
    shown = [(window, camera) for window, camera in windows if min(window.viewport[2:]) > 0]
    sizes = {window.viewport[2:] for window, _ in shown}
    if len(sizes) > 1:
        raise InputError(f"viewport: must be of one size for all eyes (got {sorted(sizes)})")
    return shown


def _viewport_of(eye: Eye) -> Viewport | None:
    if eye.viewport is None:
        return None
    try:
        left, bottom, width, height = map(index, eye.viewport)
    except (TypeError, ValueError):
        raise InputError(
            f"viewport: must be four whole numbers: left, bottom, width, height (got {eye.viewport!r})"
        ) from None
    return left, bottom, width, height


def _refuse_layer(framebuffer: moderngl.Framebuffer, layer: Any) -> None:
    if layer is None:
        return
    if not is_whole(layer) or layer < 0:
        raise InputError(f"layer: must be a whole number from 0 on (got {layer!r})")
    # of a framebuffer that another library made, moderngl knows no attachments
    for attachment in framebuffer.color_attachments or ():
        layers = getattr(attachment, "layers", 0)
        if layer >= layers:
            has = f"layers 0 to {layers - 1}" if layers else "no layers"
            raise InputError(f"layer: must be one of the framebuffer's, which has {has} (got {layer})")


def _refuse_foreign(device: Device, framebuffer: Any) -> None:
    if not isinstance(framebuffer, moderngl.Framebuffer):
        raise InputError(
            f"framebuffer: must be a moderngl.Framebuffer (got {type(framebuffer).__name__}); "
            "ctx.detect_framebuffer() finds one that another library made"
        )
    if isinstance(framebuffer.mglo, moderngl.InvalidObject):
        raise InputError("framebuffer: has been released")
    if framebuffer.ctx is not device.ctx:
        raise InputError(
            "framebuffer: must be of the context that the renderer draws with: make it with "
            "Renderer(…, ctx=ctx), where ctx is the framebuffer's"
        )


def _window_of(device: Device, eye: Eye, chosen: Viewport | None, usual: Camera) -> tuple[Window, Camera]:
    viewport, zero_to_one, depth_range = device.drawing_into(eye.framebuffer)
    viewport = chosen or viewport
    size = viewport[2:]
    if min(size) < 1:
        return Window(eye.framebuffer, (*viewport[:2], 0, 0), DepthScale(0.0, 0.0, False)), usual
    camera = camera_of(eye.camera, usual, eye.view_from_world, eye.clip_from_view, size, zero_to_one=zero_to_one)
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
