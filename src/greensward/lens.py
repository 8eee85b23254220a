"""Lenses that bend straight lines: distortion and fisheyes, put together from pinhole pictures, their faces."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from greensward.gpu.buffers import release_all
from greensward.gpu.device import Device, Stage
from greensward.gpu.full_screen import FullScreenPass
from greensward.gpu.view import View, look_at, rolled
from greensward.ground import HeightField
from greensward.scene import Camera, InputError
from greensward.truth import Truth
from greensward.viewpoint import Intrinsics, intrinsics, pinhole_view, place

Floats = npt.NDArray[np.float64]

_FINER = 2.0  # pixels of a face along one of the picture's
_OFFSETS = 4  # samples of truth along a pixel of a face: a picture's pixel has one within a sixteenth of its width
_WIDEST = np.tan(np.radians(70.0))  # of a single face, from the axis
_MARGIN_PX = 2
# rotation from the camera's axes, x right, y down, z forward, to those of a face
_TURNS = np.array(
    [
        np.eye(3),
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],  # to the right
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],  # to the left
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],  # down
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],  # up
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],  # behind
    ],
    np.float64,
)
_FROM_OPENCV = np.diag([1.0, -1.0, -1.0])


def directions(camera: Camera, size_px: tuple[int, int]) -> Floats:
    """Unit directions through the centres of a picture's pixels, (height, width, 3): x right, y down, z forward.

    NaN where a fisheye has none, more than 180° from the axis. Raises `InputError` for a distortion that folds the
    picture, and for a fisheye none of whose pixels has a ray.
    """
    return _rays(camera, size_px, np.arange(float(size_px[0])), np.arange(float(size_px[1])))


def refuse_lens(camera: Camera, size_px: tuple[int, int]) -> None:
    """Raise `InputError` for what `directions` refuses, by as few pixels as that takes, to the picture's edges."""
    columns, rows = (np.unique(np.linspace(0, side - 1, 65).round()) for side in size_px)
    _rays(camera, size_px, columns, rows)


def _rays(camera: Camera, size_px: tuple[int, int], columns: Floats, rows: Floats) -> Floats:
    lens = intrinsics(camera, size_px)
    x, y = np.meshgrid((columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy)
    if camera.projection == "fisheye":
        angle = np.hypot(x, y)
        with np.errstate(invalid="ignore"):
            aside = np.where(angle < 1e-9, 1.0, np.sin(angle) / np.maximum(angle, 1e-12))
            rays = np.stack([x * aside, y * aside, np.cos(angle)], -1)
        rays[angle > np.pi] = np.nan
        if not np.isfinite(rays).any():
            raise InputError(
                "camera: must have a ray in its picture; a fisheye has none more than 180° from its axis "
                f"(got cx_px {camera.cx_px}, cy_px {camera.cy_px})"
            )
        return rays
    undistorted = _undistorted(np.stack([x, y], -1), _coefficients(camera))
    rays = np.concatenate([undistorted, np.ones((*x.shape, 1))], -1)
    result: Floats = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return result


def project(camera: Camera, size_px: tuple[int, int], points: Floats) -> Floats:
    """Pixels (…, 2) of points (…, 3) in the camera's axes: x right, y down, z forward; as OpenCV's `projectPoints`.

    NaN for what a lens that is no fisheye has behind it.
    """
    lens = intrinsics(camera, size_px)
    x, y, z = np.moveaxis(points, -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        if camera.projection == "fisheye":
            aside = np.hypot(x, y)
            angle = np.arctan2(aside, z) / np.maximum(aside, 1e-12)
            plane = np.stack([x * angle, y * angle], -1)
        else:
            plane = _distorted(np.stack([x / z, y / z], -1), _coefficients(camera))
            plane[z <= 0.0] = np.nan
    return plane * (lens.fx, lens.fy) + (lens.cx, lens.cy)


def _coefficients(camera: Camera) -> Floats:
    return np.array([*camera.distortion, *(0.0,) * (5 - len(camera.distortion))])


def _distorted(plane: Floats, coefficients: Floats) -> Floats:
    """Brown & Conrady's model as OpenCV writes it: radial k1, k2, k3 and tangential p1, p2."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = plane[..., 0], plane[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        -1,
    )


def _undistorted(plane: Floats, coefficients: Floats) -> Floats:
    """Points that distortion brings to these, by Newton's method from the middle outwards."""
    found = np.zeros_like(plane)
    # in steps from the axis, along which a lens that does not fold has one solution
    for part in np.linspace(0.125, 1.0, 8):
        for _ in range(6):
            found = found - _solve(_jacobian(found, coefficients), _distorted(found, coefficients) - part * plane)
    slopes = np.linalg.det(_jacobian(found, coefficients))
    error = np.abs(_distorted(found, coefficients) - plane).max()
    if not error < 1e-6 or slopes.min() <= 0.0:
        given = ", ".join(f"{each:g}" for each in coefficients)
        raise InputError(
            "camera.distortion: must not fold the picture: within it, points farther from the axis must land farther "
            f"out (got {given}); take a smaller picture, or fewer coefficients"
        )
    return found


def _jacobian(plane: Floats, coefficients: Floats) -> Floats:
    k1, k2, p1, p2, k3 = coefficients
    x, y = plane[..., 0], plane[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    across = x * y * slope + 2.0 * (p1 * x + p2 * y)
    along_x = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    along_y = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    return np.stack([np.stack([along_x, across], -1), np.stack([across, along_y], -1)], -2)


def _solve(matrices: Floats, vectors: Floats) -> Floats:
    (a, b), (c, d) = np.moveaxis(matrices, (-2, -1), (0, 1))
    x, y = np.moveaxis(vectors, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]
    result: Floats = np.nan_to_num(np.clip(step, -1e3, 1e3))
    return result


@dataclass(frozen=True)
class _Face:
    """A pinhole picture of the lens: its axes, and its intrinsics for the size that all faces have."""

    turn: Floats
    lens: Intrinsics


class Lens:
    """Puts pictures of a camera together from those of its faces, and ground truth from that of their samples."""

    def __init__(self, device: Device, camera: Camera, size_px: tuple[int, int], stage: Stage) -> None:
        self._camera, self._size = camera, size_px
        rays = directions(camera, size_px)
        self._faces, self.face_size, self._number, self._at = _faces_of(camera, size_px, rays)
        limit = device.limits.picture_px
        if max(self.face_size) > limit:
            raise InputError(
                f"size: a lens needs pictures of {self.face_size[0]}x{self.face_size[1]} pixels for one of "
                f"{size_px[0]}x{size_px[1]}, and this driver draws {limit} a side; take a smaller size"
            )
        self._rays = rays
        places = np.zeros((size_px[1], size_px[0], 4), np.float32)
        places[..., :2] = (self._at + 0.5) / self.face_size
        places[..., 1] = 1.0 - places[..., 1]
        places[..., 2] = self._number
        self._places = device.ctx.texture(size_px, 4, places[::-1].tobytes(), dtype="f4")
        self._places.filter = moderngl.NEAREST, moderngl.NEAREST
        self._pass = FullScreenPass(device, "passes/lens.glsl", ["f2"], stage=stage)
        nothing = np.zeros((size_px[1], size_px[0], 4), np.float16)
        self.gathered = device.ctx.texture(size_px, 4, nothing.tobytes(), dtype="f2")
        """Radiance of the picture; 0 where the lens has none."""
        self.gathered.repeat_x = self.gathered.repeat_y = False

    def faces(self, camera: Camera, heights: HeightField) -> tuple[View, ...]:
        """Views of the faces, of one size."""
        position, target = place(camera, heights)
        view_from_world = rolled(look_at(position, target), camera.roll_deg)
        range_m = camera.near_m, camera.far_m
        return tuple(
            pinhole_view(position, _turned(face.turn) @ view_from_world, face.lens, self.face_size, range_m)
            for face in self._faces
        )

    def gather(self, radiance: moderngl.Texture, face: int) -> None:
        """Take from a face's radiance the pixels that lie in it."""
        self._pass.run(self.gathered, places=self._places, radiance=radiance, face=float(face))

    def truth(
        self,
        fill: Callable[[int, tuple[float, float]], None],
        read: Callable[[Sequence[str]], Truth],
        aovs: Sequence[str],
    ) -> Truth:
        """Ground truth of the picture: for each pixel that of a sample within a sixteenth of its width.

        `fill(face, offset_px)` draws a face with its samples moved, and `read(aovs)` reads what it shows. Depth is
        along the axis of a lens that distorts, and along the ray of a fisheye.
        """
        wanted = [*dict.fromkeys([*aovs, "depth"])]
        pixel = np.floor(self._at + 0.5).astype(np.int64)
        sample = np.clip(((self._at + 0.5 - pixel) * _OFFSETS).astype(np.int64), 0, _OFFSETS - 1)
        picked = (self._number * _OFFSETS + sample[..., 1]) * _OFFSETS + sample[..., 0]
        truth: Truth = {}
        for which in np.unique(picked[self._number >= 0]).tolist():
            face, offset = divmod(which, _OFFSETS * _OFFSETS)
            offset_px = tuple((each + 0.5) / _OFFSETS - 0.5 for each in (offset % _OFFSETS, offset // _OFFSETS))
            # rows run down in a picture and up in OpenGL
            fill(face, (-offset_px[0], offset_px[1]))
            mine = picked == which
            found = read(wanted)
            at = pixel[mine]
            for name, values in found.items():
                if name not in truth:
                    shape = (self._size[1], self._size[0], *values.shape[2:])
                    truth[name] = np.full(shape, np.inf if name == "depth" else 0, values.dtype)
                taken = values[at[:, 1], at[:, 0]]
                if name == "depth":
                    # a sample may lie behind the camera where its pixel does not
                    taken = np.where(np.isinf(taken), taken, taken * self._depth_scale(face, at + offset_px))
                if name == "motion":
                    taken = self._motion(face, at + offset_px, taken)
                truth[name][mine] = taken
        return {name: truth[name] for name in aovs if name in truth}

    def _depth_scale(self, face: int, at: Floats) -> npt.NDArray[np.float32]:
        """Factor on depth along a face's axis that gives what the picture's truth holds."""
        rays = self._face_rays(face, at)
        if self._camera.projection == "fisheye":
            return np.asarray(np.linalg.norm(rays, axis=-1), np.float32)
        return np.asarray((rays @ self._faces[face].turn)[:, 2], np.float32)

    def _face_rays(self, face: int, at: Floats) -> Floats:
        """Rays one metre deep through pixels of a face, (n, 3), in its own axes: x right, y down, z forward."""
        lens = self._faces[face].lens
        return np.stack([(at[:, 0] - lens.cx) / lens.fx, (at[:, 1] - lens.cy) / lens.fy, np.ones(len(at))], -1)

    def _motion(self, face: int, at: Floats, motion_px: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Motion in the picture, from that in a face."""
        turn = self._faces[face].turn
        now = project(self._camera, self._size, self._face_rays(face, at) @ turn)
        before = project(self._camera, self._size, self._face_rays(face, at - motion_px) @ turn)
        moved = np.where(np.any(motion_px != 0.0, axis=-1, keepdims=True), now - before, 0.0)
        # what comes from behind the lens was nowhere in the picture
        return np.nan_to_num(moved).astype(np.float32)

    def release(self) -> None:
        """Free the GPU resources."""
        release_all(self._pass, self._places, self.gathered)


def lens_key(camera: Camera) -> Camera:
    """The same lens at one place, to tell lenses apart."""
    plain = Camera()
    return camera.model_copy(
        update={name: getattr(plain, name) for name in ("position_m", "target_m", "roll_deg", "height_above_ground")}
    )


def _turned(turn: Floats) -> Floats:
    """View of a face from that of the camera, in axes x right, y up, −z forward."""
    result = np.eye(4)
    result[:3, :3] = _FROM_OPENCV @ turn @ _FROM_OPENCV
    return result


def _faces_of(
    camera: Camera, size_px: tuple[int, int], rays: Floats
) -> tuple[list[_Face], tuple[int, int], npt.NDArray[np.int64], Floats]:
    """Faces that show all rays; their size; of each pixel the number of its face, or -1, and its place there."""
    exists = np.isfinite(rays[..., 0])
    with np.errstate(invalid="ignore"):
        single = bool((rays[..., 2][exists] > 1.0 / np.hypot(1.0, _WIDEST)).all())
        # the face whose axis is nearest to the ray
        nearest = np.argmax(rays @ _TURNS[:, 2].T, axis=-1)
        chosen = np.zeros(rays.shape[:2], np.int64) if single else nearest
    number = np.full(rays.shape[:2], -1)
    planes = np.zeros((*rays.shape[:2], 2))
    used: list[int] = []
    for turn in np.unique(chosen[exists]).tolist():
        mine = exists & (chosen == turn)
        in_face = rays[mine] @ _TURNS[turn].T
        planes[mine] = in_face[:, :2] / in_face[:, 2:]
        number[mine] = len(used)
        used.append(turn)
    focal = _FINER * _finest(camera, size_px, planes)
    boxes = [(planes[number == i].min(axis=0), planes[number == i].max(axis=0)) for i in range(len(used))]
    extent = np.max([high - low for low, high in boxes], axis=0)
    size = tuple(int(np.ceil(each * focal)) + 2 * _MARGIN_PX + 1 for each in extent)
    faces = []
    at = np.zeros_like(planes)
    for i, (turn, (low, high)) in enumerate(zip(used, boxes, strict=True)):
        cx, cy = 0.5 * (np.array(size) - 1.0) - focal * 0.5 * (low + high)
        lens = Intrinsics(focal, focal, float(cx), float(cy))
        faces.append(_Face(_TURNS[turn], lens))
        at[number == i] = planes[number == i] * focal + (lens.cx, lens.cy)
    return faces, (size[0], size[1]), number, at


def _finest(camera: Camera, size_px: tuple[int, int], planes: Floats) -> float:
    """Pixels of the picture for one unit of a face, where they are the most."""
    lens = intrinsics(camera, size_px)
    if camera.projection == "fisheye":
        return max(lens.fx, lens.fy)
    finest = [lens.fx, lens.fy]
    for axis in (0, 1):
        step = np.abs(np.diff(planes[..., 1 - axis], axis=axis))
        if step.size:
            finest.append(1.0 / max(float(step.min()), 1e-9))
    return min(max(finest), 4.0 * max(lens.fx, lens.fy))
