"""`greensward view`."""

import importlib.util
from typing import Annotated

import typer

from greensward.cli.options import Overrides, Seed, Size, Technique, View, load_scene

EXAMPLES = """\b
Examples:
  greensward view
  greensward view hill
  greensward view yan2024-helicopter --technique bezier-blades
  greensward view meadow --set wind.0.speed_mps=12 --size 1600x900
"""


def view(
    scene: Annotated[
        str, typer.Argument(metavar="[SCENE]", help="A preset's name, a TOML file or its folder.")
    ] = "meadow",
    size: Size = "1280x800",
    overrides: Overrides = None,
    seed: Seed = None,
    technique: Technique = None,
    camera: View = None,
) -> None:
    """Walk through a scene in a window and change it there. Needs the extra `viewer`."""
    from greensward.scene.errors import GreenswardError

    missing = [name for name in ("imgui_bundle", "glfw") if not _is_there(name)]
    if missing:
        raise GreenswardError(
            f'view: {" and ".join(missing)} is missing, which an extra brings: pip install "greensward[viewer]"'
        )
    changed = load_scene(scene, overrides, seed, technique, camera)

    from greensward.viewer.session import Session

    try:
        from greensward.viewer.window import run
    except ImportError as error:  # a system library that a wheel cannot bring
        raise GreenswardError(
            f"view: the window toolkit cannot be loaded ({error}); on Debian or Ubuntu: sudo apt install libgl1"
        ) from None

    session = Session(scene)
    if overrides or seed is not None or technique or camera:
        session.apply(changed, "the command line")
        session.reset_camera()
    run(session, size)


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False
