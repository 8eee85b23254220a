"""The JSON of a run: written atomically, and refused with one sentence where it is invalid."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from greensward.bench.suite import FORMAT
from greensward.scene import GreenswardError, InputError, SceneError
from greensward.scene.files import read_file, written_aside
from greensward.scene.problems import sentences, short

Record = dict[str, Any]
_SAME = ("workload", "technique", "case", "width", "height")
"""Columns that say what was measured."""
_LARGEST = 256 * 2**20
_Strict = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)
_Figure = float | None


class _Row(BaseModel):
    """One measurement; other columns than these hold numbers."""

    model_config = _Strict
    __pydantic_extra__: dict[str, _Figure] = Field(init=False)
    workload: str
    technique: str
    case: str
    width: int
    height: int
    frame_ms_median: float
    frames: int
    outliers_ms: list[float] = []
    pass_ms: dict[str, _Figure] = {}
    cpu_pass_ms: dict[str, _Figure] | None = None
    published: str = ""
    scene_hash: str | None = None
    flip: float | None = None
    samples: int | None = None

    @model_validator(mode="after")
    def _has_samples(self) -> Self:
        if self.flip is not None and self.samples is None:
            raise ValueError("must have samples beside flip")
        return self


class _Skipped(BaseModel):
    """A case that could not be measured, and why."""

    model_config = ConfigDict(strict=True, extra="forbid")
    workload: str = ""
    technique: str = ""
    case: str = ""
    reason: str = ""


class _Machine(BaseModel):
    """Machine of a run, and its settings."""

    model_config = _Strict
    __pydantic_extra__: dict[str, str | float | bool | None] = Field(init=False)
    libraries: dict[str, str | None] = {}
    skipped: list[_Skipped] = []
    incomplete: str | None = None
    commit: str | None = None
    camera_path: str | None = None


class _Record(BaseModel):
    """The file of a run."""

    model_config = ConfigDict(strict=True, extra="forbid")
    machine: _Machine
    rows: list[_Row]


def write(path: Path, record: Record) -> None:
    """Write the file aside and rename it. Raises `GreenswardError`."""
    with written_aside(path) as stream:
        stream.write((json.dumps(record, indent=1) + "\n").encode())


def read(path: Path) -> Record:
    """Read what `write` wrote. Raises `InputError` for anything else, and for another version of the format.

    What is not as `write` has it is told in a sentence each.
    """
    try:
        record: Record = json.loads(read_file(path, _LARGEST, "a record of measurements"))
    except (ValueError, RecursionError):
        raise InputError(f"{path}: is no JSON; give a file that greensward bench --json wrote") from None
    machine = record.get("machine") if isinstance(record, dict) else None
    rows = record.get("rows") if isinstance(record, dict) else None
    if not isinstance(machine, dict) or not isinstance(rows, list):
        raise InputError(f"{path}: holds no measurements; give a file that greensward bench --json wrote")
    if (found := machine.get("format", "unknown")) != FORMAT:
        by = short(machine.get("greensward", "unknown"), False)
        raise InputError(
            f"{path}: is of format {short(found, False)}, written by greensward {by}, and must "
            f"be of format {FORMAT}; measure again"
        )
    try:
        _Record.model_validate(record)
    except ValidationError as error:
        raise SceneError(sentences(error, _Record, lambda _: str(path))) from None
    return record


def merged(records: Mapping[Path, Record]) -> Record:
    """Runs of one machine as one record; of what was measured twice, the later counts. Raises `InputError`."""
    machines = [record["machine"] for record in records.values()]
    for name in ("driver", "clock", "greensward"):
        if len(found := {machine.get(name) for machine in machines}) > 1:
            listed = ", ".join(sorted(map(str, found)))
            raise InputError(f"--from: the files must be of one {name} (got {listed}); give each its own report")
    rows = {tuple(row[name] for name in _SAME): row for record in records.values() for row in record["rows"]}
    skipped = [each for machine in machines for each in machine.get("skipped", [])]
    incomplete = "; ".join(filter(None, (machine.get("incomplete") for machine in machines))) or None
    commits = ", ".join(dict.fromkeys(machine["commit"] for machine in machines if machine.get("commit"))) or None
    machine = {**machines[-1], "commit": commits, "skipped": skipped, "incomplete": incomplete}
    return {"machine": machine, "rows": list(rows.values())}


def check_folder(folder: Path) -> None:
    """Make the report's folder, or raise before hours of work if nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder}: cannot hold the report: {error.strerror or error}; name another folder"
        ) from None
    try:
        with written_aside(folder / "report.md.trial") as stream:
            stream.write(b"")
        (folder / "report.md.trial").unlink()
    except GreenswardError as error:
        raise InputError(f"{error}; name another folder for the report") from None
    except OSError as error:
        raise InputError(
            f"{folder}: cannot hold the report: {error.strerror or error}; name another folder"
        ) from None
