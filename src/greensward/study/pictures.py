"""Pictures and clips of a study, drawn from its scenes."""

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from greensward.io.rasters import write_picture
from greensward.io.video import VideoWriter, check_video, find_ffmpeg
from greensward.renderer import Renderer
from greensward.scene.errors import GreenswardError, InputError, SceneError
from greensward.scene.files import is_there, read_file, written_aside
from greensward.scene.load import dump, load, presets
from greensward.scene.scene import Scene
from greensward.study.model import Picture, Study
from greensward.techniques import SETTINGS

PICTURES = "pictures"
"""Folder of the pictures, in that of the study."""
_MADE = "made.json"
_FPS = 30.0
_MOST_BYTES = 1 << 20


@dataclass(frozen=True)
class Drawn:
    """A picture that is to be drawn, and the digest of all that it is made of."""

    picture: Picture
    scene: Scene
    file: Path
    digest: str


def to_draw(study: Study, folder: Path, again: bool = False) -> list[Drawn]:
    """Pictures of the study that are not there as its file describes them, or all.

    Raises `SceneError` with the problems of all scenes, and for files that are missing.
    """
    made = {} if again else _made(folder)
    problems: list[str] = []
    found: list[Drawn] = []
    for i, picture in enumerate(study.picture):
        if picture.file is not None:
            if not is_there(folder / picture.file):
                problems.append(f"picture[{i}].file: no file {picture.file} is in {folder}")
            continue
        try:
            scene = load(
                picture.scene if picture.scene in presets() else folder / picture.scene,
                overrides=picture.set,
                technique=picture.technique or None,
                technique_settings=SETTINGS,
            )
        except SceneError as error:
            problems += [f"picture[{i}]: {problem}".replace(": --set: ", ".set: ", 1) for problem in error.problems]
            continue
        suffix = "mp4" if picture.seconds else "png"
        file = folder / PICTURES / f"{picture.name}.{suffix}"
        digest = _digest(study, picture, scene)
        if made.get(file.name) != digest or not is_there(file):
            found.append(Drawn(picture, scene, file, digest))
    if problems:
        raise SceneError(problems)
    for drawn in found:
        if drawn.picture.seconds:
            check_video(folder / drawn.file.name, study.size, _FPS)  # the folder of pictures may not be there yet
            find_ffmpeg()
    return found


def draw(
    study: Study, folder: Path, drawn: Drawn, device: str = "auto", notify: Callable[..., None] | None = None
) -> None:
    """Draw a picture or a clip into the study's folder."""
    picture = drawn.picture
    drawn.file.parent.mkdir(parents=True, exist_ok=True)
    with _named(picture), Renderer(drawn.scene, size=study.size, samples=picture.samples, device=device) as renderer:
        if picture.seconds:
            with VideoWriter(drawn.file, study.size, _FPS) as video:
                for frame in range(max(round(picture.seconds * _FPS), 1)):
                    video.add(_lined(renderer.render(picture.time_s + frame / _FPS).image, picture))
                video.finish()
        else:
            write_picture(drawn.file, _lined(renderer.render(picture.time_s, progress=notify).image, picture))
    made = _made(folder) | {drawn.file.name: drawn.digest}
    with written_aside(folder / PICTURES / _MADE) as stream:
        stream.write((json.dumps(made, indent=1, sort_keys=True) + "\n").encode())


def missing_pictures(study: Study, folder: Path) -> list[str]:
    """Names of the pictures of a study that are not there, whatever they show."""
    return [picture.name for picture in study.picture if picture_file(folder, picture) is None]


def picture_file(folder: Path, picture: Picture) -> Path | None:
    """The file of a picture, or None where it is not there."""
    if picture.file is not None:
        own = folder / picture.file
        return own if is_there(own) else None
    file = folder / PICTURES / f"{picture.name}.{'mp4' if picture.seconds else 'png'}"
    return file if is_there(file) else None


def is_clip(folder: Path, picture: Picture) -> bool:
    """True if a picture moves."""
    file = picture_file(folder, picture)
    return file is not None and file.suffix.lower() in (".mp4", ".webm")


@contextlib.contextmanager
def _named(picture: Picture) -> Iterator[None]:
    """Name the picture in what its scene is refused for."""
    try:
        yield
    except InputError as error:
        raise InputError(f"picture {picture.name}: {error}") from None


def _digest(study: Study, picture: Picture, scene: Scene) -> str:
    of = [picture.model_dump_json(exclude={"alt", "caption"}), list(study.size), dump(scene)]
    return hashlib.sha256(json.dumps(of).encode()).hexdigest()[:16]


def _made(folder: Path) -> dict[str, str]:
    """Digests of the pictures that were drawn; none where their list is missing or damaged."""
    try:
        made = json.loads(read_file(folder / PICTURES / _MADE, _MOST_BYTES, "a list of pictures"))
    except (GreenswardError, ValueError, RecursionError):
        return {}
    return made if isinstance(made, dict) else {}


def _lined(image: npt.NDArray[np.uint8], picture: Picture) -> npt.NDArray[np.uint8]:
    """The picture with its lines, each a 160th of its height thick."""
    height = len(image)
    half = max(height // 320, 1)
    image = image.copy() if picture.lines else image
    for line in picture.lines:
        row = round(line.at * (height - 1))
        image[max(row - half, 0) : row + half] = [int(line.colour[i : i + 2], 16) for i in (1, 3, 5)]
    return image
