"""Views: a camera, its mirror image, or the sun for a shadow map."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from greensward.gpu.layouts import block

Matrix = npt.NDArray[np.float64]
_ANCHORS_M = 8192.0
"""Distance of anchors along x and z: near one, a float32 is exact to half a millimetre."""


def anchor_near(point_ws: Matrix) -> Matrix:
    """Find the anchor of a camera (3,): the point of the world from which shaders count, in small numbers."""
    x, _, z = _ANCHORS_M * np.round(point_ws / _ANCHORS_M)
    return np.array([x + 0.0, 0.0, z + 0.0])  # without a negative zero


def anchored(moved: Matrix, anchor_ws: Matrix) -> Matrix:
    """Matrices (..., 4, 4) that take points of the world to points counted from an anchor."""
    result = moved.copy()
    result[..., :3, 3] -= anchor_ws
    return result


VIEW_BLOCK = block(
    "View",
    # relative space is the world seen from `origin_ws`, a point by the camera: exact wherever the camera is;
    # that point and all others of the world are counted from the camera's anchor
    ("clip_from_relative", "mat4"),
    ("jittered_clip_from_relative", "mat4"),
    ("previous_clip_from_relative", "mat4"),
    ("origin_ws", "vec4"),
    ("eye_rs", "vec4"),  # perspective: xyz, 1. Parallel: the direction towards the viewer, 0
    ("axis_rs", "vec4"),  # unit view axis, and its offset: depth = dot(axis, p) + w
    ("eye_ws", "vec4"),
    ("camera_ws", "vec4"),  # where the picture is taken from, also while a shadow map is drawn
    ("size_px", "vec4"),  # width, height and their inverses
    ("middle_ray", "vec4"),  # rays one metre deep: through the middle of the picture,
    ("right_ray", "vec4"),  # and what half its width
    ("up_ray", "vec4"),  # and half its height add
    ("middle_start_rs", "vec4"),  # where they start, at depth 0, likewise: perspective rays at the eye
    ("right_start", "vec4"),
    ("up_start", "vec4"),
    ("parallel_depth_m", "vec4"),  # depth in a parallel view: x + y * clip z, or z + w * the fragment's
    ("range_m", "vec2"),  # depths between which anything shows
    ("camera_pixel_m", "vec2"),  # as pixel_m, of the picture that the camera takes
    ("jitter", "vec2"),  # of this sample, in clip space
    ("pixel_m", "vec2"),  # a pixel's size at depth d is x * d + y
    ("density", "float"),  # part of the blades to draw; the rest are widened
    ("clip_below_m", "float"),  # nothing below this height shows
    ("low_detail", "int"),  # only blades of the low-detail subset
)


@dataclass(frozen=True, eq=False)
class View:
    """Camera, matrices for column vectors, and `purpose`: the attachments that a technique draws into."""

    purpose: Literal["picture", "shadow"]
    clip_from_world: Matrix
    eye_ws: npt.NDArray[np.float64]
    axis_ws: npt.NDArray[np.float64]
    camera_ws: npt.NDArray[np.float64]
    size_px: tuple[int, int]
    pixel_m: tuple[float, float]
    """Size of a pixel at depth d: the first times d, and the second."""
    camera_pixel_m: tuple[float, float]
    """The same of the picture that the camera takes, by distance."""
    density: float = 1.0
    clip_below_m: float = -1e9
    """Height in the world below which nothing shows; a mirrored view must leave out what lies under water."""
    low_detail: bool = False
    """True where only blades of the density map's low-detail subset show."""
    rays_ws: Matrix = field(default_factory=lambda: np.zeros((3, 3)))
    """Rows: a ray one metre deep through the middle of the picture, and what half its width and height add."""
    starts_ws: Matrix = field(default_factory=lambda: np.zeros((3, 3)))
    """Rows: where that ray starts, at depth 0, and what half the picture's width and height add."""

    def planes_ws(self) -> Matrix:
        """The six clip planes, rows (nx, ny, nz, d), inside where n·p + d ≥ 0 (Gribb & Hartmann 2001)."""
        m = self.clip_from_world
        return np.concatenate([m[3] + m[:3], m[3] - m[:3]])

    @property
    def anchor_ws(self) -> npt.NDArray[np.float64]:
        """Point of the world, (3,), from which shaders count."""
        return anchor_near(self.camera_ws)

    @property
    def origin_ws(self) -> npt.NDArray[np.float64]:
        """Origin of relative space, (3,): exact as a float32, as is what lies near it, seen from it."""
        return self.camera_ws.astype(np.float32).astype(np.float64)

    @property
    def world_from_relative(self) -> Matrix:
        """The translation by `origin_ws`."""
        moved = np.eye(4)
        moved[:3, 3] = self.origin_ws
        return moved

    def relative(self, moved: Matrix) -> Matrix:
        """A rigid matrix that moves points of the world, for points of relative space."""
        result = moved.copy()
        result[:3, 3] += moved[:3, :3] @ self.origin_ws - self.origin_ws
        return result

    def mirrored(self, level_m: float, size_px: tuple[int, int]) -> "View":
        """The view of the world as a level plane mirrors it.

        In its picture, of this size, a point lies where its image lies in the picture of this view.
        """
        flip = np.diag([1.0, -1.0, 1.0, 1.0])
        flip[1, 3] = 2.0 * level_m
        x, y, z, w = self.axis_ws
        larger = self.size_px[1] / size_px[1]
        return replace(
            self,
            clip_from_world=self.clip_from_world @ flip,
            eye_ws=flip @ self.eye_ws,
            axis_ws=np.array([x, -y, z, w + 2.0 * level_m * y]),
            size_px=size_px,
            pixel_m=(self.pixel_m[0] * larger, self.pixel_m[1] * larger),
            camera_pixel_m=(self.camera_pixel_m[0] * larger, self.camera_pixel_m[1] * larger),
            rays_ws=self.rays_ws @ flip[:3, :3],
            starts_ws=self.starts_ws @ flip[:3, :3] + np.outer([1.0, 0.0, 0.0], flip[:3, 3]),
            clip_below_m=level_m,
            low_detail=True,
        )

    @property
    def is_parallel(self) -> bool:
        """True if its rays are parallel."""
        return bool(self.eye_ws[3] == 0.0)

    @cached_property
    def near_and_far_m(self) -> tuple[float, float]:
        """Depths between which the view shows anything: clip z is a · depth + b, and clip w the depth or 1."""
        z, axis = self.clip_from_world[2], self.axis_ws
        a = float(z[:3] @ axis[:3])
        b = float(z[3] - a * axis[3])
        if self.is_parallel:
            return (-1.0 - b) / a, (1.0 - b) / a
        return -b / (1.0 + a), b / (1.0 - a)


def view_values(view: View, previous: View, offset_px: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    """Members of the `View` block: the view, the one a frame ago, and the sub-sample's offset in pixels."""
    width, height = view.size_px
    origin, moved, anchor = view.origin_ws, view.world_from_relative, view.anchor_ws
    jitter = 2.0 * offset_px[0] / width, 2.0 * offset_px[1] / height
    relative = view.clip_from_world @ moved
    jittered = relative.copy()
    jittered[0] += jitter[0] * relative[3]
    jittered[1] += jitter[1] * relative[3]
    return {
        "clip_from_relative": relative,
        "jittered_clip_from_relative": jittered,
        "previous_clip_from_relative": previous.clip_from_world @ moved,
        "origin_ws": (*(origin - anchor), 0.0),
        "eye_rs": (*(view.eye_ws[:3] - origin * view.eye_ws[3]), view.eye_ws[3]),
        "axis_rs": (*view.axis_ws[:3], view.axis_ws[:3] @ origin + view.axis_ws[3]),
        "eye_ws": (*(view.eye_ws[:3] - anchor * view.eye_ws[3]), view.eye_ws[3]),
        "camera_ws": (*(view.camera_ws - anchor), 1.0),
        "size_px": (width, height, 1.0 / width, 1.0 / height),
        "middle_ray": (*view.rays_ws[0], 0.0),
        "right_ray": (*view.rays_ws[1], 0.0),
        "up_ray": (*view.rays_ws[2], 0.0),
        "middle_start_rs": (*(view.starts_ws[0] - origin), 1.0),
        "right_start": (*view.starts_ws[1], 0.0),
        "up_start": (*view.starts_ws[2], 0.0),
        "range_m": view.near_and_far_m,
        "camera_pixel_m": view.camera_pixel_m,
        "jitter": jitter,
        "pixel_m": view.pixel_m,
        "density": view.density,
        "clip_below_m": view.clip_below_m,
        "low_detail": int(view.low_detail),
    }


def _cross(a: Sequence[float] | Matrix, b: Sequence[float] | Matrix) -> Matrix:
    # np.cross costs more than all the rest of a view
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def look_at(position: npt.ArrayLike, target: npt.ArrayLike) -> Matrix:
    """`view_from_world` of an eye at `position` looking at `target`, y up, −z forward."""
    eye = np.asarray(position, np.float64)
    forward = np.asarray(target, np.float64) - eye
    forward /= np.linalg.norm(forward)
    # level, unless it looks straight up or down
    right = _cross(forward, (0.0, 1.0, 0.0) if abs(forward[1]) < 0.999 else (0.0, 0.0, -1.0))
    right /= np.linalg.norm(right)
    up = _cross(right, forward)
    matrix = np.eye(4)
    matrix[:3, :3] = right, up, -forward
    matrix[:3, 3] = -matrix[:3, :3] @ eye
    return matrix


def rolled(view_from_world: Matrix, roll_deg: float) -> Matrix:
    """The same of a camera turned about its axis, clockwise as it sees."""
    if not roll_deg:
        return view_from_world
    cos, sin = np.cos(np.radians(roll_deg)), np.sin(np.radians(roll_deg))
    turn = np.eye(4)
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    result: Matrix = turn @ view_from_world
    return result


def parallel(half_width: float, near: float, far: float) -> Matrix:
    """`clip_from_view` of a square parallel view, of OpenGL's −1 to 1 clip space."""
    matrix = np.diag([1.0 / half_width, 1.0 / half_width, -2.0 / (far - near), 1.0])
    matrix[2, 3] = -(far + near) / (far - near)
    return matrix


def planes_of(views: Sequence[View]) -> Matrix:
    """Six clip planes of each view, one view after the other: (6 views, 4)."""
    return np.concatenate([view.planes_ws() for view in views])


def boxes_in_view(planes: Matrix, centre: Matrix, half: Matrix) -> npt.NDArray[np.bool_]:
    """Test boxes, (n, 3) each, against the planes of views: bool (views, n). A box outside one plane is out."""
    reach = planes[:, :3] @ centre.T + np.abs(planes[:, :3]) @ half.T + planes[:, 3:]
    shown: npt.NDArray[np.bool_] = np.all((reach >= 0.0).reshape(len(planes) // 6, 6, -1), axis=1)
    return shown


def distance_to_boxes(point: npt.NDArray[np.float64], centre: Matrix, half: Matrix) -> npt.NDArray[np.float64]:
    """Metres from a point to the nearest of each box, (n,)."""
    beside = np.maximum(np.abs(point - centre) - half, 0.0)
    distance: npt.NDArray[np.float64] = np.sqrt(np.einsum("ij,ij->i", beside, beside))
    return distance
