"""Checkpoints: simulation state after a clip's last frame, from which the next clip continues."""

import math
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from greensward.io.arrays import read_npy
from greensward.io.rasters import write_npz
from greensward.scene.errors import InputError
from greensward.scene.files import check_memory, open_file

_MOST_CLIP_BYTES, _MOST_SHRUNK = 4096, 100


@dataclass(frozen=True)
class Checkpoint:
    """State that a clip passes on to the next."""

    start_s: float
    """Frame 0 shows this instant."""
    fps: float
    """Frames a second."""
    following: int
    """Number of the frame that comes next; it shows `start_s + following / fps`."""
    scene: str
    """A hash of the scene."""
    state: Mapping[str, npt.NDArray[Any]]
    """Arrays of `Renderer.checkpoint`."""


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint as an `.npz` file."""
    clip = {name: value for name, value in vars(checkpoint).items() if name != "state"}
    write_npz(path, {**checkpoint.state, **{f"clip_{name}": value for name, value in clip.items()}})


def read_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint. Raises `InputError` for a file that is none."""
    try:
        state = _arrays(path)
        following = float(state.pop("clip_following"))
        start_s, fps = float(state.pop("clip_start_s")), float(state.pop("clip_fps"))
        scene = str(state.pop("clip_scene"))
        if not (scene and 0 < fps <= 240 and math.isfinite(start_s) and following >= 1 and following.is_integer()):
            raise ValueError
        return Checkpoint(start_s, fps, int(following), scene, state)
    except (InputError, MemoryError):
        raise
    except Exception:  # a damaged archive raises nearly anything
        raise InputError(
            f"{path}: is damaged or no checkpoint; `greensward animate --checkpoint` writes one"
        ) from None


def _arrays(path: Path) -> dict[str, npt.NDArray[Any]]:
    """The arrays of an archive by name, which hold finite numbers or text. Anything else raises `ValueError`."""
    found = {}
    with open_file(path) as stream, zipfile.ZipFile(stream) as archive:
        members = archive.infolist()
        unpacked = sum(member.file_size for member in members)
        # poses of blades hardly shrink
        if unpacked > _MOST_CLIP_BYTES + _MOST_SHRUNK * os.fstat(stream.fileno()).st_size:
            raise ValueError("it unpacks to far more than any state")
        check_memory(path, 2 * unpacked, "free some, or draw without it")
        for member in members:
            if member.filename.startswith("clip_") and member.file_size > _MOST_CLIP_BYTES:
                raise ValueError(f"{member.filename} is no single value")
            with archive.open(member) as opened:
                array = read_npy(opened, member.file_size)
            if array.dtype.kind not in "biufU" or (array.dtype.kind == "f" and not np.isfinite(array).all()):
                raise ValueError(f"{member.filename} holds no finite numbers")
            found[member.filename.removesuffix(".npy")] = array
    return found
