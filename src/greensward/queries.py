"""Answers about a scene as it stands: what a ray hits, what a blade is, and the light that a host may light with."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from greensward.passes.sky import irradiance
from greensward.scene.classes import SurfaceClass

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
