"""Opening and saving of scenes: the file, its text, and the files that the scene names."""

import hashlib
import os
import re
import shutil
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from greensward.library import load, presets
from greensward.scene import InputError, Scene
from greensward.scene.files import written_aside
from greensward.scene.load import preset_file
from greensward.scene.save import saved_text
from greensward.viewer.fields import all_keys, value_at, with_value


@dataclass(frozen=True)
class Origin:
    """Source of a scene: a file, or a preset, which is never written to."""

    name: str
    file: Path | None
    text: str | None
    """Text of the file or preset as it was read; saving keeps its comments."""


def open_scene(source: str) -> tuple[Scene, Origin]:
    """Load the scene of a preset's name, a file or a folder. Raises `SceneError`."""
    scene = load(source)
    if source in presets():
        return scene, Origin(source, None, _text(preset_file(source)))
    path = Path(source)
    path = path / "scene.toml" if path.is_dir() else path
    return scene, Origin(path.stem if path.stem != "scene" else path.resolve().parent.name, path, _text(path))


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig")


def changed_elsewhere(origin: Origin) -> bool:
    """Return True if another program has written the file since it was read or saved."""
    if origin.file is None:
        return False
    try:
        return _text(origin.file) != origin.text
    except FileNotFoundError:
        return False
    except (OSError, ValueError):
        return True


def exists(path: Path) -> bool:
    """Return True if the file exists; False as well if the system cannot tell."""
    try:
        return path.exists()
    except OSError:
        return False


def entered_path(text: str, suffix: str) -> Path | None:
    """Return the path that a user entered, with this suffix if it has none; None if it cannot name a file."""
    text = text.strip()
    try:
        path = Path(text).expanduser()
        if not text or text.endswith(("/", os.sep)) or path.is_dir():
            return None
        path = path if path.suffix else path.with_suffix(suffix)
        path.exists()
    except (OSError, ValueError, RuntimeError):  # too long a name, no name, no such user
        return None
    return path


def printable(text: str) -> str:
    """Replace what cannot be shown: names of files may hold bytes that are not characters."""
    return text.encode(errors="replace").decode()


def save(scene: Scene, path: Path, original: str | None) -> tuple[Scene, str]:
    """Write a scene, and copy the files that it names beside it; return the scene as written, and its text.

    The text keeps comments and order of `original`. Raises `InputError` on failure, and then leaves no partial file.
    """
    if path.suffix.lower() != ".toml":
        raise InputError(f"{path}: the file's name must end in .toml")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")
    if path.exists() and not os.access(path, os.W_OK):  # a rename replaces it all the same
        raise InputError(f"{path}: is write-protected; save under another name")
    moved = _with_files_beside(scene, path)
    text = saved_text(original, moved)
    _check_loadable(text, path)
    with written_aside(path) as stream:
        stream.write(text.encode())
    return moved.in_folder(path.parent), text


def _check_loadable(text: str, path: Path) -> None:
    """Refuse to replace a valid file by one that cannot be loaded."""
    try:
        Scene.model_validate(tomllib.loads(text.removeprefix("\ufeff")))
    except ValueError as error:
        reason = "; ".join(str(error).splitlines()[:3])
        raise InputError(f"{path}: not written, as the scene could not be loaded again: {reason}") from None


def _with_files_beside(scene: Scene, path: Path) -> Scene:
    """Return the scene with file names relative to the folder of `path`; files outside it are copied there."""
    folder = path.parent.resolve()
    beside = folder / f"{path.stem}-files"
    for at, spec in list(all_keys(scene)):
        held = value_at(scene, at)
        if not spec.files or not held:
            continue
        names = [held] if isinstance(held, str) else list(held)
        moved = [_file_in(scene.resolve(name).resolve(), folder, beside) for name in names]
        if moved != names:
            scene = with_value(scene, at, moved[0] if isinstance(held, str) else tuple(moved))
    return scene


def _file_in(file: Path, folder: Path, beside: Path) -> str:
    """Return the name of a file relative to `folder`; a file outside it is copied to `beside`."""
    if file.is_relative_to(folder):
        return file.relative_to(folder).as_posix()
    copy = beside / file.name
    try:
        beside.mkdir(exist_ok=True)
        if copy.exists() and copy.read_bytes() != file.read_bytes():
            copy = beside / f"{file.stem}-{hashlib.sha256(file.read_bytes()).hexdigest()[:8]}{file.suffix}"
        shutil.copyfile(file, copy)
    except OSError as error:
        raise InputError(f"{copy}: cannot be written: {error.strerror or error}") from None
    return copy.relative_to(folder).as_posix()


def write_map(path: Path, density_map: npt.NDArray[np.uint8]) -> None:
    """Write a density map with fast compression, as after every stroke."""
    with written_aside(path) as stream:
        Image.fromarray(density_map).save(stream, "PNG", compress_level=1)


def free_name(folder: Path, stem: str, suffix: str, taken: Iterable[Path] = ()) -> Path:
    """Return a file name that is neither used nor `taken`: `meadow-001.png`, then `meadow-002.png`."""
    stem = re.sub(r"[^\w-]+", "-", stem).strip("-") or "scene"
    numbers = (
        int(found[1])
        for p in (*folder.glob(f"{stem}-*{suffix}"), *taken)
        if p.parent == folder and (found := re.fullmatch(rf"{re.escape(stem)}-(\d+){re.escape(suffix)}", p.name))
    )
    return folder / f"{stem}-{max(numbers, default=0) + 1:03d}{suffix}"
