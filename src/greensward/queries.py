"""Answers about a scene as it stands: what a ray hits, what a blade is, and the light that a host may light with."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from greensward.gpu.view import View, look_at
from greensward.objects.placing import finite_vector
from greensward.passes.gbuffer import GBuffer
from greensward.passes.sky import irradiance
from greensward.scene import InputError
from greensward.scene.classes import SurfaceClass
from greensward.sowing.identity import Ids
from greensward.viewpoint import Intrinsics, pinhole_view
from greensward.world import World

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blade:
    """A blade of grass that is stored around the camera."""

    species: str
    """Species, as `[[grass]]` names it."""
    root_m: Floats
    """World position, (3,), at rest."""
    height_m: float
    """Length along its curve."""
    width_m: float
    object_index: int | None = None
    """Index of the object that it grows on; None on the ground."""


@dataclass(frozen=True, eq=False)
class Hit:
    """First surface along a ray."""

    point_m: Floats
    """World position, (3,)."""
    distance_m: float
    surface: SurfaceClass
    object_index: int | None = None
    """Index in `Scene.object`, where it is an object's."""
    object_name: str = ""
    blade_id: int = 0
    """Permanent id, where it is a blade's or a flower's."""
    blade: Blade | None = None
    """The blade itself, if it is stored."""


@dataclass(frozen=True, eq=False)
class Light:
    """Light of a scene, in the linear units of `encoding="hdr"`, so that a host lights its own things alike."""

    to_sun: Floats
    """Unit vector, (3,)."""
    sun_irradiance: Floats
    """Red, green, blue at the ground on a surface that faces the sun, (3,)."""
    sky_harmonics: Floats
    """Spherical harmonics of the sky's radiance up to order 2, (9, 3) (Ramamoorthi & Hanrahan 2001)."""
    exposure: float
    """Factor from radiance to what the tone curve takes, 0.2 for a grey card."""

    def sky_irradiance(self, normals: npt.ArrayLike) -> Floats:
        """Compute the sky's irradiance on surfaces with these unit normals, (..., 3): red, green, blue, (..., 3)."""
        given = np.asarray(normals, np.float64)
        return irradiance(self.sky_harmonics, given.reshape(-1, 3)).reshape(given.shape)


def unit_ray(origin_m: npt.ArrayLike, direction: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Origin and unit direction of a ray, (3,) each. Raises `InputError` for one that is none."""
    origin, along = finite_vector("origin_m", origin_m), finite_vector("direction", direction)
    length = float(np.linalg.norm(along))
    if length == 0.0:
        raise InputError("direction: must not be zero (got 0, 0, 0)")
    return origin, along / length


def points_on_ground(x: npt.ArrayLike, z: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Coordinates as arrays of one shape. Raises `InputError` for what are no finite numbers of matching shapes."""
    try:
        given = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))
    except (TypeError, ValueError) as error:
        raise InputError(f"x, z: must be numbers, or arrays of one shape ({error})") from None
    if not all(np.isfinite(each).all() for each in given):
        raise InputError("x, z: must be finite (got NaN or infinity)")
    return given[0], given[1]


def probe_view(origin: Floats, along: Floats, picture: View, far_m: float) -> View:
    """View of one pixel along a ray, as wide as a picture's.

    From the picture's own eye it is a part of that picture, whose axis decides how finely blades are cut.
    """
    facing = float(picture.axis_ws[:3] @ along)
    if picture.is_parallel:
        lens = Intrinsics(1.0 / picture.pixel_m[1], 1.0 / picture.pixel_m[1], 0.0, 0.0)
        view = pinhole_view(origin, look_at(origin, origin + along), lens, (1, 1), (1e-3, far_m), parallel=True)
        return replace(view, camera_ws=picture.camera_ws)
    if facing < 0.1 or np.abs(origin - picture.camera_ws).max() > 1e-6:
        pixel = picture.pixel_m[0]
        lens = Intrinsics(1.0 / pixel, 1.0 / pixel, 0.0, 0.0)
        return pinhole_view(origin, look_at(origin, origin + along), lens, (1, 1), (1e-3, far_m))
    half_width, half_height = (float(np.linalg.norm(each)) for each in picture.rays_ws[1:])
    right, up = picture.rays_ws[1] / half_width, picture.rays_ws[2] / half_height
    fx, fy = 0.5 * picture.size_px[0] / half_width, 0.5 * picture.size_px[1] / half_height
    lens = Intrinsics(fx, fy, -fx * float(right @ along) / facing, fy * float(up @ along) / facing)
    pose = np.eye(4)
    pose[:3, :3] = right, up, -picture.axis_ws[:3]
    pose[:3, 3] = -pose[:3, :3] @ picture.camera_ws
    return pinhole_view(picture.camera_ws, pose, lens, (1, 1), picture.near_and_far_m)


def hit_in(
    probe: GBuffer, identify: Callable[..., Ids], world: World, origin: Floats, along: Floats, view: View
) -> Hit | None:
    """Read what the one pixel of a probe shows along its ray."""
    kinds, numbers, depths = probe.read_surface()
    blade_id = int(identify(kinds, numbers)[0, 0])
    kind, number = SurfaceClass(int(kinds[0, 0])), int(numbers[0, 0])
    distance = float(depths[0, 0]) / float(view.axis_ws[:3] @ along)
    water = world.scene.water
    if water and origin[1] > water.level_m and along[1] < 0.0:
        to_water = (water.level_m - float(origin[1])) / float(along[1])
        if to_water < distance:
            return Hit(origin + to_water * along, to_water, SurfaceClass.WATER)
    if not np.isfinite(distance):
        return None
    solid = number - 1 if kind == SurfaceClass.OBJECT and number else None
    return Hit(
        origin + distance * along,
        distance,
        kind,
        solid if solid is not None and solid < len(world.scene.object) else None,
        world.objects[solid].name if solid is not None else "",
        blade_id,
        blade_with(world, number) if kind == SurfaceClass.GRASS else None,
    )


def blade_with(world: World, number: int) -> Blade | None:
    """The stored blade with a number of this frame; None if it has none."""
    found = world.field.stored(number) if number else None
    if found is None:
        return None
    row, root_m, index = found
    species = world.scene.grass[int(row["flags"]) & 15].species
    return Blade(species, root_m, float(row["height"]), float(row["width"]), index)
