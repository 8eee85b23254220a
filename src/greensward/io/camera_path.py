"""Camera paths: key frames in a TOML file that people write and programs record."""

import hashlib
from collections.abc import Iterable
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, ValidationError, model_validator

from greensward.scene.base import Flag, Many, Model, Number, Point
from greensward.scene.errors import InputError, SceneError
from greensward.scene.files import is_there, written_aside
from greensward.scene.light import INTRINSICS, Camera
from greensward.scene.load import read_table
from greensward.scene.plain import plain
from greensward.scene.problems import sentences
from greensward.scene.toml_text import spelled

_Floats = npt.NDArray[np.float64]


class CameraKey(Model):
    """Key frame: the camera at one instant."""

    time_s: Annotated[Number, Field(ge=0, le=1e6)]
    """Time of the key; it rises from key to key."""
    position_m: Point
    """Position of the camera."""
    target_m: Point
    """Point that it looks at."""
    fov_y_deg: Annotated[Number, Field(gt=0.1, lt=170)] | None = None
    """Vertical field of view; without one in any key, that of the scene's camera."""

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.position_m == self.target_m:
            raise ValueError("target_m must differ from position_m")
        return self


class CameraPath(Model):
    """A camera that moves: keys, joined by curves through position and target."""

    height_above_ground: Flag = True
    """True if the y of positions and targets is above the ground below each."""
    after: Literal["stop", "repeat", "return"] = "stop"
    """Behaviour past the last key: stay there, start again, or return along the path."""
    key: Annotated[Many[CameraKey], Field(min_length=2, max_length=100_000)]
    """Key frames, in order."""

    @model_validator(mode="after")
    def _keys_fit(self) -> Self:
        for later, (one, other) in enumerate(pairwise(self.key), 1):
            if other.time_s <= one.time_s:
                raise ValueError(
                    f"key[{later}].time_s must be above {one.time_s:g}, the time of the key before "
                    f"(got {other.time_s:g})"
                )
            if (other.fov_y_deg is None) != (one.fov_y_deg is None):
                raise ValueError(f"fov_y_deg must stand in every key or in none (key[{later}] differs)")
        return self

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read the path of a TOML file. Raises `InputError` with every error, one sentence each."""
        path = Path(path)
        if not is_there(path):
            raise InputError(f"{path}: no such file; a camera path is a TOML file with key = [...]")
        return cls._of(read_table(path, str(path), "a camera path"), str(path))

    @classmethod
    def recorded(cls, frames: Iterable[tuple[float, Camera]]) -> Self:
        """The path of cameras as they were at times in seconds, which rise; its own time starts at 0.

        Raises `InputError` for fewer than two, and where only some count heights from the ground.
        """
        seen = list(frames)
        kinds = {camera.height_above_ground for _, camera in seen}
        if len(seen) < 2 or len(kinds) > 1:
            raise InputError(
                f"camera path: must be of two cameras at least (got {len(seen)}), with the same height_above_ground"
            )
        keys = [
            {"time_s": time_s - seen[0][0], **camera.model_dump(include={"position_m", "target_m", "fov_y_deg"})}
            for time_s, camera in seen
        ]
        return cls._of({"height_above_ground": kinds.pop(), "key": keys}, "camera path")

    @classmethod
    def _of(cls, table: dict[str, Any], origin: str) -> Self:
        try:
            return cls.model_validate(table)
        except ValidationError as error:
            raise SceneError(dict.fromkeys(sentences(error, cls, lambda _: origin))) from None

    def write(self, path: str | Path) -> None:
        """Write the file that `read` reads, a line for each key, aside and renamed. Raises `GreenswardError`."""
        table = plain(self)
        lines = [f"{name} = {spelled(value)}\n" for name, value in table.items() if name != "key"]
        keys = [f"  {spelled(key)},\n" for key in table["key"]]
        with written_aside(Path(path)) as stream:
            stream.write("".join([*lines, "key = [\n", *keys, "]\n"]).encode())

    @property
    def end_s(self) -> float:
        """Time of the last key."""
        return self.key[-1].time_s

    @property
    def digest(self) -> str:
        """First digits of a SHA-256 of the path."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()[:16]

    def at(self, time_s: float, camera: Camera | None = None) -> Camera:
        """The camera at an instant, which waits at the first key; fields that the path lacks are those of `camera`.

        The curve is a Catmull-Rom spline with non-uniform knots, through all keys.
        """
        times, keys, slopes = self._curve
        on_path = self._within(time_s)
        i = int(np.clip(np.searchsorted(times, on_path, side="right") - 1, 0, len(times) - 2))
        span = times[i + 1] - times[i]
        t = (on_path - times[i]) / span
        start, chord = keys[i], keys[i + 1] - keys[i]
        # cubic Hermite, as what it adds to the straight line
        bow = t * (1.0 - t) * ((1.0 - t) * (slopes[i] * span - chord) - t * (slopes[i + 1] * span - chord))
        now = start + t * chord + bow
        # a curve may swing beyond its keys, which a lens cannot
        fov_y_deg = float(np.clip(now[6], *sorted((keys[i][6], keys[i + 1][6]))))
        update = {
            "position_m": tuple(map(float, now[:3])),
            "target_m": tuple(map(float, now[3:6])),
            "height_above_ground": self.height_above_ground,
            **({} if self.key[0].fov_y_deg is None else {"fov_y_deg": fov_y_deg, **dict.fromkeys(INTRINSICS)}),
        }
        return (camera or Camera()).model_copy(update=update)

    def _within(self, time_s: float) -> float:
        first, span = self.key[0].time_s, self.end_s - self.key[0].time_s
        since = max(time_s - first, 0.0)
        if self.after == "repeat":
            since %= span
        elif self.after == "return":
            since = span - abs(span - since % (2.0 * span))
        return first + min(since, span)

    @cached_property
    def _curve(self) -> tuple[_Floats, _Floats, _Floats]:
        times = np.array([key.time_s for key in self.key])
        keys = np.array([(*key.position_m, *key.target_m, key.fov_y_deg or 0.0) for key in self.key])
        return times, keys, np.gradient(keys, times, axis=0)
