"""Winds: what moves the blades. They add up."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from greensward.scene.base import (
    Count,
    FileNames,
    Flag,
    GroundPoint,
    Model,
    Number,
    OptionalPoint,
    Pair,
    Point,
    Size,
    default,
)

MOST_WINDS = 8
Direction = Annotated[Number, Field(ge=-360, le=360)]
Speed = Annotated[Number, Field(ge=0, le=200)]
_Velocity = Annotated[Number, Field(ge=-200, le=200)]
Length = Annotated[Number, Field(ge=0.01, le=10_000)]
Time = Annotated[Number, Field(ge=0.001, le=1e6)]


def _odd(cells: int) -> int:
    if cells % 2 == 0:
        raise ValueError("must be odd, so that the camera has a cell in the middle")
    return cells


class Gusts(Model):
    """Gusts that travel with the wind. They are analytic: no state, any instant can be drawn."""

    kind: Literal["gusts"] = "gusts"
    direction_deg: Direction = 250.0
    """Direction it blows from, clockwise from north (−z), as in a weather report."""
    speed_mps: Speed = 4.5
    """Mean speed."""
    gustiness: Number = Field(default=0.6, ge=0, le=1)
    """Variation of the speed by the gusts."""
    gust_m: Length = 9.0
    """Size of a gust."""
    turbulence: Number = Field(default=0.3, ge=0, le=1)
    """Small eddies and the flutter of each blade."""


class Strong(Model):
    """Strong natural wind: one direction over the whole field, its strength a travelling wave (Yan et al. 2024)."""

    kind: Literal["strong"] = "strong"
    direction_deg: Direction = 315.0
    """Direction it blows from, clockwise from north (−z)."""
    power_mps: Speed = 8.0
    """Speed at the crest of a wave."""
    speed_mps: Speed = 6.0
    """Speed at which the waves travel."""
    interval_m: Length = 2.0
    """Distance over which the wave's phase grows by one radian."""
    steadiness: Number = Field(default=0.0, ge=0, le=1)
    """0 swings to and fro with the wave, as published; 1 blows steadily."""


class Helicopter(Model):
    """The downwash of a helicopter that circles above the field: rings that run outwards (Yan et al. 2024)."""

    kind: Literal["helicopter"] = "helicopter"
    centre_m: GroundPoint = default((0.0, 0.0))
    """Middle of the circle that it flies: x and z."""
    radius_m: Annotated[Number, Field(ge=0, le=10_000)] = 6.0
    """Radius of that circle."""
    height_m: Length = 5.0
    """Height above the ground that it flies at."""
    period_s: Time = 12.0
    """Time for one round."""
    rotor_m: Annotated[Number, Field(ge=0.2, le=10_000)] = 3.0
    """Diameter of the rotor."""
    power_mps: Speed = 16.0
    """Speed of the air at its strongest, near the ground below the rim of the rotor."""
    speed_mps: Speed = 7.0
    """Speed at which the rings run outwards."""
    interval_m: Length = 0.6
    """Distance over which the phase of the rings grows by one radian."""
    steadiness: Number = Field(default=0.5, ge=0, le=1)
    """0 blows out and in with the rings; from ½ on only outwards; 1 has no rings."""
    published: Flag = False
    """True as in the report: the direction is normalize(-1, 0, 1) plus the offset from the centre and keeps its
    length, so the air is faster and its rings are closer the farther away they are, without bound. `power_mps` is
    then the speed a metre away, `interval_m` counts square metres, and `rotor_m` only sizes the helicopter."""
    drawn: Flag = True
    """True if the helicopter itself is visible."""


class Random(Model):
    """Random natural wind: every blade has a direction of its own, all swell and turn together (Yan et al. 2024)."""

    kind: Literal["random"] = "random"
    power_mps: Speed = 3.0
    """Greatest speed."""
    period_s: Time = 6.2832
    """Time for one swing to and fro."""


class Waves(Model):
    """Waves that cross the field in three directions at once (Jahrmann & Wimmer 2017)."""

    kind: Literal["waves"] = "waves"
    direction_deg: Direction = 315.0
    """Direction it blows from, clockwise from north (−z)."""
    speed_mps: Speed = 6.0
    """Speed between the waves."""
    rate_hz: Annotated[Number, Field(ge=1e-6, le=100)] = 0.4
    """Waves per second at one place."""


class Blast(Model):
    """Blasts from a point, as rings that run outwards (Jahrmann & Wimmer 2017)."""

    kind: Literal["blast"] = "blast"
    centre_m: Point = default((0.0, 1.0, 0.0))
    """Centre; y is above the ground."""
    power_mps: Speed = 100.0
    """Speed at the centre."""
    rate: Number = Field(default=4.0, ge=0.001, le=100)
    """Radians per second by which the rings move on."""


class Whirl(Model):
    """A whirl about a point: outwards and around, faster near its eye (Jahrmann & Wimmer 2017)."""

    kind: Literal["whirl"] = "whirl"
    centre_m: Point = default((0.0, 1.0, 0.0))
    """Its eye; y is above the ground."""
    power_mps: Speed = 40.0
    """Radial speed."""
    swirl_mps: Speed = 6.0
    """Scale of the tangential speed, which is up to ten times this where the radial one is small."""
    rate: Number = Field(default=1.5, ge=0.001, le=100)
    """Radians per second by which its rings move on."""


class Ripples(Model):
    """Two overlapping waves that run downwind behind bowed fronts (Jahrmann & Wimmer 2013, Eq. 9).

    The paper does not give the constants of its formula; these suit a meadow of metres.
    """

    kind: Literal["ripples"] = "ripples"
    direction_deg: Direction = 90.0
    """Direction it blows from, clockwise from north (−z); at 90 the formula's axes are x and z."""
    speed_mps: Speed = 6.0
    """Greatest speed, to and fro."""
    wave_m: Length = 7.0
    """Distance from crest to crest: 2 / c1."""
    swell_m: Length = 31.0
    """Wavelength of the wave that overlaps it: 2 / c3."""
    front_m: Length = 12.0
    """Distance across the wind between the tips of the fronts: 1 / c2."""
    epsilon: Number = Field(default=0.08, ge=0.001, le=10)
    """Limit on the lead of the fronts' tips, which is 1 / (4 epsilon) metres at most."""
    rate_hz: Annotated[Number, Field(ge=1e-6, le=100)] = 0.3
    """Crests per second at one place: the formula's t is 2π / c1 times this, a second."""


class Texture(Model):
    """Wind as images: red blows towards east (+x), green towards south (+z), middle grey is calm."""

    kind: Literal["texture"] = "texture"
    files: Annotated[FileNames, Field(min_length=1, max_length=256)]
    """The images, shown one after the other, blended, in a loop."""
    size_m: Size = default((40.0, 40.0))
    """Extent of an image on the ground, centred on the origin; it repeats."""
    speed_mps: Speed = 10.0
    """Speed at full colour."""
    moves_mps: Pair[_Velocity] = default((0.0, 0.0))
    """Velocity at which the images move over the ground, along x and z."""
    rate_hz: Annotated[Number, Field(ge=1e-6, le=1000)] = 4.0
    """Images per second."""


class Idle(Model):
    """Light wind to and fro, in which each blade has a phase of its own (Derstroff, section 2.6)."""

    kind: Literal["idle"] = "idle"
    direction_deg: Direction = 315.0
    """Direction it blows from first, clockwise from north (−z); at 315 the source's, (1, 0, 1)."""
    speed_mps: Speed = 1.5
    """Greatest speed, to and fro."""
    period_s: Time = 3.0
    """Time for one swing to and fro."""


class Wake(Model):
    """Wind behind what moves: a wind field with memory around the camera (Derstroff, section 2.3).

    It is the one wind with state. A scene has at most one.
    """

    kind: Literal["wake"] = "wake"
    by: Literal["camera", "objects", "both"] = "camera"
    """Movers of the air: the camera, as published, moving objects of the scene, or both."""
    strength: Number = Field(default=20.0, ge=0, le=1000)
    """Acceleration of the air in m/s² for each m/s of a mover, times a bell-shaped curve over the distance."""
    reach_m: Number = Field(default=3.0, ge=0.1, le=1000)
    """Scale of that curve; air at more than twice this distance hardly moves."""
    downwash_mps2: Number = Field(default=0.0, ge=0, le=10_000)
    """Greatest outward acceleration of the air around objects that move it, as below a drone."""
    damping: Number = Field(default=0.74, ge=0, le=1)
    """Fraction of the speed that is left after a second; the source's 0.995 a frame at 60 frames per second."""
    cells: Annotated[Count, Field(ge=3, le=257), AfterValidator(_odd)] = 65
    """Cells along a side of the wind field; odd."""
    cell_m: Number = Field(default=1.0, ge=0.05, le=100)
    """Side of a cell. The wind field has the camera in its middle, and beyond it the air is calm."""


Wind = Annotated[
    Gusts | Strong | Helicopter | Random | Waves | Blast | Whirl | Texture | Ripples | Idle | Wake,
    Field(discriminator="kind"),
]


class Mass(Model):
    """Winds as forces: heavy blades move less than light ones (Derstroff, section 4.3).

    What a wind gives is the acceleration of a blade of the reference mass. The force for that acts on every blade,
    and the acceleration of each is the force divided by its own mass.
    """

    reference_kg: Annotated[Number, Field(ge=1e-9, le=1000)] | None = None
    """Mass of a blade that moves as without this table. If left out, that of a blade of mean size and mass."""


class Simulation(Model):
    """Dynamics of the blades: they swing, lag, are pressed down and rise. Without it their motion is analytic."""

    form: Literal["natural", "yan2024", "jahrmann2017"] = "natural"
    """Equation of motion: a damped spring about the pose in the wind, or that of either paper."""
    step_s: Number = Field(default=1.0 / 60.0, ge=0.001, le=0.1)
    """Time step, independent of the frame rate."""
    settle_s: Number = Field(default=2.0, ge=0, le=600)
    """Simulated time before the first picture, and after a longer gap in time."""
    within_m: Number = Field(default=60.0, ge=0.01, le=100_000)
    """Blades farther from the camera move analytically; the last fifth of the distance blends."""
    gravity_mps2: Number = Field(default=9.8, ge=0, le=1000)
    """Pull of gravity."""
    gravity_centre_m: OptionalPoint = default(None)
    """Centre of gravity; without one, gravity pulls down."""
    gravity_towards: Number = Field(default=1.0, ge=0, le=1)
    """Weight of the pull towards `gravity_centre_m`: at 1 gravity pulls towards it, at 0 straight down."""
    forward: Number = Field(default=0.25, ge=0, le=10)
    """Fraction of gravity that pulls a blade towards its front (both papers)."""
    recovery_hz: Annotated[Number, Field(ge=0.0001, le=10_000)] | None = None
    """Rate of recovery of the stiffest blade per second, in the papers' forms. If left out, 45 in `yan2024` and 15 in
    `jahrmann2017`."""
    reference_m: Number = Field(default=1.0, ge=0, le=100)
    """Height of the blades that the papers' constants are for: what gravity and winds do to others is multiplied by
    their height over it, so that grass of any size stands. 0 leaves them as published, the same for all sizes."""
    rise_s: Number = Field(default=2.0, ge=0.001, le=1e6)
    """Time after which a pressed blade of full stiffness rises freely; softer ones take up to ten times as long."""
