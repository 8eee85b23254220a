"""Scene view for a notebook."""

from pathlib import Path
from typing import TYPE_CHECKING

from greensward.library import as_scene
from greensward.scene import GreenswardError, Scene

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
    """Return a view of a scene, a preset's name or a file, for the last line of a cell in Jupyter.

    Dragging turns the camera, with the right button it orbits the point in view; without ground, every button orbits.
    WASD or the arrow keys walk, Q and E lower and raise the camera, Shift is fast. The wheel zooms. The space bar
    stops and starts time, which begins at `time_s`. `size` is the size on the page in pixels; while something moves,
    the resolution is lower if frames take long, and a still picture is anti-aliased over several frames.

    The view has `technique`, `playing` and `time_s`, which may be set at any time, and `camera`.
    Raises `InputError` for a scene that cannot be drawn, and `GreenswardError` without the extra `notebook`.
    """
    try:
        from greensward.viewer.widget import SceneView
    except ImportError as error:
        raise GreenswardError(
            f'a view in a notebook needs {error.name} of an extra: pip install "greensward[notebook]"'
        ) from None
    return SceneView(as_scene(scene, technique), time_s=time_s, playing=playing, size=size, device=device)
