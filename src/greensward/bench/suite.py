"""A run of the benchmark: every case by every technique, a row each, and a list of what was not measured."""

import hashlib
import math
import platform
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import moderngl

from greensward import __version__
from greensward.bench.protocol import DeviceLostError, Pace, Subject, clock, measure, pace
from greensward.bench.quality import WORKLOAD as QUALITY
from greensward.bench.quality import Picture, compare_techniques
from greensward.bench.strips import InstancedStrips
from greensward.bench.workloads import (
    CPU_SIZE,
    GPU_SIZE,
    STRIPS,
    TOY_SIZE,
    Case,
    Scale,
    Workload,
    drawn_by,
    toy,
)
from greensward.gpu.device import Device
from greensward.gpu.timers import PassTimers
from greensward.io.camera_path import CameraPath
from greensward.renderer import Renderer
from greensward.scene import GreenswardError, Scene
from greensward.scene.load import dump, named_files
from greensward.techniques import FAR, SETTINGS

FORMAT = 1
"""Version of the JSON format."""
_LOST = (DeviceLostError, moderngl.Error, MemoryError)
_LIBRARIES = ("moderngl", "numpy", "pydantic", "flip-evaluator", "matplotlib")


@dataclass(frozen=True)
class Wanted:
    """Request of a user; what is empty is up to each workload."""

    workloads: Sequence[Workload]
    techniques: Sequence[str] = ()
    sizes: Sequence[tuple[int, int]] = ()
    frames: int | None = None
    protocol: str = "quick"
    scale: Scale = "quick"
    quality: bool = True
    device: str = "auto"
    path: CameraPath | None = None
    """Path of the camera in every workload; without one, the same loop from each scene's own camera."""


@dataclass
class Result:
    """Results so far; `json` is the file, `pictures` are for the report only."""

    machine: dict[str, Any]
    rows: list[dict[str, Any]] = field(default_factory=list)
    pictures: dict[str, Picture] = field(default_factory=dict)

    @property
    def json(self) -> dict[str, Any]:
        """The file: what ran, and flat rows."""
        return {"machine": self.machine, "rows": self.rows}

    def skip(self, workload: str, technique: str, case: str, why: str) -> None:
        """Note what was not measured, so that everyone sees it."""
        self.machine["skipped"].append({"workload": workload, "technique": technique, "case": case, "reason": why})


def machine(wanted: Wanted) -> tuple[dict[str, Any], bool]:
    """Describe the machine, and return whether the CPU draws. Raises `GreenswardError`."""
    device = Device.shared(wanted.device)
    software = device.software
    at = pace(wanted.protocol, wanted.frames, software)
    return {
        "format": FORMAT,
        "greensward": __version__,
        "commit": commit(Path(__file__).parent),
        "driver": device.name,
        "vendor": device.ctx.info["GL_VENDOR"],
        "opengl": device.ctx.info["GL_VERSION"],
        "software": software,
        "clock": clock(device, PassTimers(device)),
        "system": platform.platform(),
        "processor": processor(),
        "python": platform.python_version(),
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "protocol": at.name,
        "scale": wanted.scale,
        "frames": at.frames,
        "warm_up": at.warm_up,
        "camera_path": wanted.path.digest if wanted.path else None,
        "skipped": [],
        "incomplete": None,
    }, software


def commit(folder: Path) -> str | None:
    """The git commit of the package's source, `+` if changed; None where it is not in a repository of its own."""
    try:
        answers = [
            subprocess.run(
                ["git", "-C", str(folder), *command], capture_output=True, text=True, timeout=10, check=True
            ).stdout.strip()
            for command in (
                ["ls-files", "suite.py"],
                ["rev-parse", "--short=12", "HEAD"],
                ["diff", "HEAD", "--stat", "--", ".."],
            )
        ]
    except (OSError, subprocess.SubprocessError):
        return None
    tracked, name, changed = answers
    return f"{name}{'+' if changed else ''}" if tracked else None


def processor() -> str:
    """The CPU's own name, where the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine()
    )


def _version(library: str) -> str | None:
    try:
        return version(library)
    except PackageNotFoundError:
        return None


def scene_hash(scene: Scene, path: CameraPath | None = None) -> str:
    """The first digits of the SHA-256 of a scene, of every file that it names, and of a camera path."""
    digest = hashlib.sha256(dump(scene).encode())
    for _, file in named_files(scene, SETTINGS):
        digest.update(file.read_bytes())
    digest.update(path.digest.encode() if path else b"")
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class _Job:
    workload: Workload
    case: Case
    technique: str
    size: tuple[int, int]


def _jobs(wanted: Wanted, result: Result) -> Iterator[_Job]:
    """Every case by every technique at every size; what cannot be measured is noted instead."""
    own = TOY_SIZE if wanted.scale == "toy" else CPU_SIZE if result.machine["software"] else GPU_SIZE
    for workload in wanted.workloads:
        for technique in wanted.techniques or workload.techniques:
            for case in workload.cases:
                if not case.suits(technique):
                    continue
                if wanted.scale == "quick" and not case.quick:
                    result.skip(workload.name, technique, case.name, "takes long: --scale full")
                    continue
                sizes = wanted.sizes or [own if wanted.scale == "toy" else case.size or own]
                for size in sizes:
                    yield _Job(workload, case, technique, size)


def run(
    wanted: Wanted, *, notify: Callable[[str], None] = lambda _: None, keep: Callable[[Result], None] = lambda _: None
) -> Result:
    """Measure everything wanted. `keep` is called after each row with the results so far.

    A case that cannot be drawn is noted under `machine.skipped`; if the device is lost, `machine.incomplete` says
    what is missing, and the rows so far are returned.
    """
    described, software = machine(wanted)
    result = Result(described)
    at = pace(wanted.protocol, wanted.frames, software)
    jobs = list(_jobs(wanted, result))
    for done, job in enumerate(jobs):
        label = f"{job.workload.name}, {job.technique}, {job.case.name}"
        try:
            row = _row(job, wanted, at)
        except _LOST as error:
            described["incomplete"] = f"{_message(error)} after {done} of {len(jobs)} measurements, in {label}"
            return result
        except GreenswardError as error:
            result.skip(job.workload.name, job.technique, job.case.name, str(error))
            notify(f"{label}: skipped: {error}")
            continue
        result.rows.append(row)
        described["incomplete"] = f"stopped after {done + 1} of {len(jobs)} measurements"
        notify(f"{label}: {row['frame_ms_median']:.2f} ms, {row['over_floor']:.1f} × floor")
        keep(result)
    described["incomplete"] = None
    if wanted.quality:
        _add_quality(result, wanted, at, notify, keep)
    keep(result)
    return result


def _row(job: _Job, wanted: Wanted, at: Pace) -> dict[str, Any]:
    scene = job.case.scene(job.technique)
    if wanted.scale == "toy":
        scene = toy(scene)
    scene = drawn_by(job.technique, scene, job.case.settings)
    subject: Subject
    kind = InstancedStrips if job.technique == STRIPS else Renderer
    began_s = time.perf_counter()
    with kind(scene, size=job.size, device=wanted.device) as subject:
        case = job.case
        if case.frames and at.name == "quick" and not (wanted.frames or subject.device.software):
            at = replace(at, frames=case.frames, most_s=math.inf)
        measured = measure(
            subject,
            scene.camera,
            job.size,
            at,
            wanted.path,
            case.still,
            began_s,
            0.0 if wanted.path else case.flight_mps,
        )
    return {
        "workload": job.workload.name,
        "technique": job.technique,
        "case": job.case.name,
        "width": job.size[0],
        "height": job.size[1],
        **measured,
        "scene_hash": scene_hash(scene, wanted.path),
        "published": job.case.published,
    }


def _add_quality(
    result: Result, wanted: Wanted, at: Pace, notify: Callable[[str], None], keep: Callable[[Result], None]
) -> None:
    result.machine["incomplete"] = "stopped before all techniques were compared at equal picture"
    techniques = [name for name in wanted.techniques or SETTINGS if name != STRIPS]
    if wanted.scale == "quick" and result.machine["software"] and not wanted.techniques:
        # its shadow maps take a CPU ten seconds a frame
        techniques.remove(FAR.name)
        result.skip(QUALITY, FAR.name, "", "takes long: --scale full")

    def add(row: dict[str, Any], picture: Picture) -> None:
        if not row:
            result.pictures["reference"] = picture
            return
        result.rows.append(row)
        result.pictures[f"{row['technique']}, {row['case']}"] = picture
        notify(f"quality, {row['technique']}, {row['case']}: FLIP {row['flip']}, {row['frame_ms_median']:.2f} ms")
        keep(result)

    # a frame of many samples is many frames
    brief = replace(at, frames=min(at.frames, 3 if result.machine["software"] else 31), least_s=0.0, warm_up=1)
    try:
        missing = compare_techniques(techniques, brief, wanted.scale, wanted.device, add)
    except _LOST as error:
        result.machine["incomplete"] = f"techniques are not all compared at equal picture: {_message(error)}"
        return
    except GreenswardError as error:
        missing = str(error)
    result.machine["incomplete"] = None
    if missing:
        result.skip(QUALITY, "", "", missing)


def _message(error: BaseException) -> str:
    return "memory ran out" if isinstance(error, MemoryError) else str(error)
