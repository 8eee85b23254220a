"""The JSON of a run: written atomically, and refused with one sentence where it is invalid."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from greensward.bench.suite import FORMAT
from greensward.io.rasters import written_aside
from greensward.scene import GreenswardError, InputError

Record = dict[str, Any]
_COLUMNS = ("workload", "technique", "case", "width", "height", "frame_ms_median", "frames")


def write(path: Path, record: Record) -> None:
    """Write the file aside and rename it. Raises `GreenswardError`."""
    with written_aside(path) as stream:
        stream.write((json.dumps(record, indent=1) + "\n").encode())


def read(path: Path) -> Record:
    """Read what `write` wrote. Raises `InputError` for anything else, and for another version of the format."""
    try:
        record: Record = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"{path}: is no JSON; give a file that greensward bench --json wrote") from None
    machine = record.get("machine") if isinstance(record, dict) else None
    rows = record.get("rows") if isinstance(record, dict) else None
    if not isinstance(machine, dict) or not isinstance(rows, list):
        raise InputError(f"{path}: holds no measurements; give a file that greensward bench --json wrote")
    if (found := machine.get("format", "unknown")) != FORMAT:
        raise InputError(
            f"{path}: is of format {found}, written by greensward {machine.get('greensward', 'unknown')}, and must "
            f"be of format {FORMAT}; measure again"
        )
    for number, row in enumerate(rows):
        lacking = [name for name in _COLUMNS if not isinstance(row, dict) or name not in row]
        if lacking:
            raise InputError(f"{path}: rows[{number}]: lacks {lacking[0]}; measure again")
    return record


def merged(records: Mapping[Path, Record]) -> Record:
    """Runs of one machine as one record; of what was measured twice, the later counts. Raises `InputError`."""
    machines = [record["machine"] for record in records.values()]
    for name in ("driver", "clock", "greensward"):
        if len(found := {machine.get(name) for machine in machines}) > 1:
            listed = ", ".join(sorted(map(str, found)))
            raise InputError(f"--from: the files must be of one {name} (got {listed}); give each its own report")
    rows = {tuple(row[name] for name in _COLUMNS[:5]): row for record in records.values() for row in record["rows"]}
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
