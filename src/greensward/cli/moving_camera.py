"""A camera that moves along a path while a clip is drawn."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from greensward.io.camera_path import CameraPath
    from greensward.renderer import Renderer
    from greensward.scene.light import Camera


def read_path(file: Path | None, camera: str | None) -> "CameraPath | None":
    """Read the path that `--camera-path` names. Raises `InputError`, also where `--camera` says otherwise."""
    from greensward.io.camera_path import CameraPath
    from greensward.scene.errors import InputError

    if file and camera is not None:
        raise InputError("--camera-path: must stand without --camera, as it says where the camera is")
    return CameraPath.read(file) if file else None


def cameras(
    renderer: "Renderer", times_s: Iterable[float], path: "CameraPath | None", file: Path | None
) -> "Callable[[float], Camera | None]":
    """The camera of an instant. Raises `InputError` if it is in the ground at one of those that will be drawn."""
    from greensward.scene.errors import InputError

    if path is None:
        return lambda _: None
    for time_s in times_s:
        try:
            renderer.camera_matrices(path.at(time_s, renderer.scene.camera))
        except InputError as error:
            raise InputError(f"{file}: at {time_s:g} s: {error}") from None
    return lambda time_s: path.at(time_s, renderer.scene.camera)
