"""Where a scene comes from and goes to: its file, its text, and the files that it names."""

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

from greensward.io.rasters import read_rgba, written_aside
from greensward.library import load, presets
from greensward.scene import InputError, Scene
from greensward.scene.load import preset_file
from greensward.scene.save import saved_text
from greensward.viewer.fields import value_at, walk, with_value


@dataclass(frozen=True)
class Origin:
    """What was opened: a file, or a preset, which is never written to."""

    name: str
    file: Path | None
    text: str | None
    """The file, or the preset's, as it was read; a scene that is saved keeps its comments."""


def opened(source: str) -> tuple[Scene, Origin]:
    """The scene of a preset's name, a file or a folder. Raises `SceneError`."""
    scene = load(source)
    if source in presets():
        return scene, Origin(source, None, _text(preset_file(source)))
    path = Path(source)
    path = path / "scene.toml" if path.is_dir() else path
    return scene, Origin(path.stem if path.stem != "scene" else path.resolve().parent.name, path, _text(path))


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig")


def changed_elsewhere(origin: Origin) -> bool:
    """Whether someone else has written the file since it was read or saved."""
    if origin.file is None:
        return False
    try:
        return _text(origin.file) != origin.text
    except FileNotFoundError:
        return False
    except (OSError, ValueError):
        return True


def is_there(path: Path) -> bool:
    """Whether there is such a file; one that cannot be asked for is not."""
    try:
        return path.exists()
    except OSError:
        return False


def typed(text: str, ending: str) -> Path | None:
    """The file that someone names, with this ending if they give none; None where that is no file's name."""
    text = text.strip()
    try:
        path = Path(text).expanduser()
        if not text or text.endswith(("/", os.sep)) or path.is_dir():
            return None
        path = path if path.suffix else path.with_suffix(ending)
        path.exists()
    except (OSError, ValueError, RuntimeError):  # too long a name, no name, no such user
        return None
    return path


def legible(text: str) -> str:
    """A text that can be shown; names of files may hold bytes that are no characters."""
    return text.encode(errors="replace").decode()


def text_of(scene: Scene, original: str | None) -> str:
    """The scene as TOML; with the comments and the order of the text that it was opened from."""
    return saved_text(original, scene)


def save(scene: Scene, path: Path, original: str | None) -> tuple[Scene, str]:
    """Write a scene and what it names that is elsewhere; returns it as it was written, and its text.

    Raises `InputError` where that cannot be done; then nothing is half-written.
    """
    if path.suffix.lower() != ".toml":
        raise InputError(f"{path}: the file's name must end in .toml")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    if path.exists() and not os.access(path, os.W_OK):  # a file put in its place would not ask
        raise InputError(f"{path}: is write-protected; save under another name")
    moved = _with_files_beside(scene, path)
    text = text_of(moved, original)
    _check_that_it_loads(text, path)
    with written_aside(path) as stream:
        stream.write(text.encode())
    return moved.in_folder(path.parent), text


def _check_that_it_loads(text: str, path: Path) -> None:
    """What cannot be read again must not take a good file's place."""
    try:
        Scene.model_validate(tomllib.loads(text.removeprefix("\ufeff")))
    except ValueError as error:
        reason = "; ".join(str(error).splitlines()[:3])
        raise InputError(f"{path}: not written, as the scene could not be read again: {reason}") from None


def _with_files_beside(scene: Scene, path: Path) -> Scene:
    """The scene, the files that it names found from the folder of `path`; they are copied there if need be."""
    folder = path.parent.resolve()
    beside = folder / f"{path.stem}-files"
    for at, spec in list(walk(scene)):
        held = value_at(scene, at)
        if not spec.files or not held:
            continue
        names = [held] if isinstance(held, str) else list(held)
        kept = [_kept(scene.resolve(name).resolve(), folder, beside) for name in names]
        if kept != names:
            scene = with_value(scene, at, kept[0] if isinstance(held, str) else tuple(kept))
    return scene


def _kept(file: Path, folder: Path, beside: Path) -> str:
    """How a scene in `folder` names a file, which is copied if it lies elsewhere."""
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


def write_map(path: Path, canvas: npt.NDArray[np.uint8]) -> None:
    """Write a density map; quickly, as every stroke does."""
    with written_aside(path) as stream:
        Image.fromarray(canvas).save(stream, "PNG", compress_level=1)


def same_picture(path: Path, canvas: npt.NDArray[np.uint8]) -> bool:
    """Whether a file holds this picture."""
    return bool(np.array_equal(read_rgba(path)[..., :3], canvas))


def free_name(folder: Path, stem: str, suffix: str, taken: Iterable[Path] = ()) -> Path:
    """A file that is neither there nor `taken`: `meadow-001.png`, then `meadow-002.png`."""
    stem = re.sub(r"[^\w-]+", "-", stem).strip("-") or "scene"
    numbers = (
        int(found[1])
        for p in (*folder.glob(f"{stem}-*{suffix}"), *taken)
        if p.parent == folder and (found := re.fullmatch(rf"{re.escape(stem)}-(\d+){re.escape(suffix)}", p.name))
    )
    return folder / f"{stem}-{max(numbers, default=0) + 1:03d}{suffix}"


def is_toml(text: str) -> bool:
    """Whether a text is TOML at all."""
    try:
        tomllib.loads(text)
    except (ValueError, RecursionError):
        return False
    return True
