"""Time of day from the position of the sun, on a day in May at 48° north."""

import functools
import math

_LATITUDE, _DECLINATION = math.radians(48.0), math.radians(19.0)
EARLIEST_H, LATEST_H = 4.0, 20.5


def sun_at(hour: float) -> tuple[float, float]:
    """Return azimuth, clockwise from north, and elevation of the sun in degrees at a solar hour of 0 to 24."""
    angle = math.radians(15.0 * (hour - 12.0))
    sine = math.sin(_LATITUDE) * math.sin(_DECLINATION) + math.cos(_LATITUDE) * math.cos(_DECLINATION) * math.cos(
        angle
    )
    east = -math.cos(_DECLINATION) * math.sin(angle)
    north = math.cos(_LATITUDE) * math.sin(_DECLINATION) - math.sin(_LATITUDE) * math.cos(_DECLINATION) * math.cos(
        angle
    )
    return math.degrees(math.atan2(east, north)) % 360.0, math.degrees(math.asin(sine))


@functools.lru_cache(maxsize=1)
def hour_of(azimuth_deg: float, elevation_deg: float) -> float:
    """Return the hour at which the sun comes nearest to a direction."""

    def distance(hour: float) -> float:
        azimuth, elevation = sun_at(hour)
        across = math.radians((azimuth - azimuth_deg + 180.0) % 360.0 - 180.0)
        return (elevation - elevation_deg) ** 2 + math.degrees(across * math.cos(math.radians(elevation))) ** 2

    return min((EARLIEST_H + (LATEST_H - EARLIEST_H) * i / 480.0 for i in range(481)), key=distance)
