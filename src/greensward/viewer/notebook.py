"""A scene in a notebook."""

from pathlib import Path
from typing import TYPE_CHECKING

from greensward.library import load
from greensward.scene import GreenswardError, Scene, TechniqueChoice

if TYPE_CHECKING:
    from greensward.viewer.widget import SceneView


def show(
    scene: Scene | str | Path,
    *,
    technique: str | None = None,
    time_s: float = 0.0,
    playing: bool = True,
    size: tuple[int, int] = (640, 360),
    device: str = "auto",
) -> "SceneView":
    """A view of a scene, of a preset's name or of a file, for the last line of a cell in Jupyter.

    Drag to look about, or with the right button to go around what is in the middle; where there is no ground, both do
    that. WASD or the arrows walk, around what stands in the way, Q and E make you smaller and taller, shift is fast.
    The wheel zooms. The space bar stops and starts time, which begins at `time_s`; a picture that rests grows clean.
    `size` is that on the page in pixels; where frames take long, fewer are drawn while something moves.

    What is returned has `technique`, `playing` and `time_s`, which may be set at any time, and `eye.camera()`.
    Raises `InputError` for what the scene asks and cannot be had, and `GreenswardError` without the extra `notebook`.
    """
    try:
        from greensward.viewer.widget import SceneView
    except ImportError as error:
        raise GreenswardError(
            f'a view in a notebook needs {error.name}, which an extra brings: pip install "greensward[notebook]"'
        ) from None
    if not isinstance(scene, Scene):
        scene = load(scene, technique=technique)
    elif technique is not None and technique != scene.technique.name:
        scene = scene.model_copy(update={"technique": TechniqueChoice(name=technique)})
    return SceneView(scene, time_s=time_s, playing=playing, size=size, device=device)
