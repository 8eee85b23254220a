"""Commands of the viewer: each with its help, its keys and the function that keys and buttons trigger."""

from collections.abc import Callable
from dataclasses import dataclass

from greensward.viewer.viewer import Viewer


@dataclass(frozen=True)
class Command:
    """Command with its help, its key chords, and the function that carries it out."""

    help: str
    keys: tuple[str, ...]
    """Chords such as `ctrl+shift+z`: modifiers first."""
    run: Callable[[Viewer], object]
    while_dragging: bool = True
    """Permission to run while a mouse button drags something."""

    @property
    def shown_keys(self) -> str:
        """Chords as text: `Ctrl+Shift+Z or Ctrl+Y`."""
        return " or ".join("+".join(part.capitalize() for part in chord.split("+")) for chord in self.keys)


def _use_technique(number: int) -> Command:
    return Command(f"Technique {number}", (str(number),), lambda viewer: viewer.session.use_nth_technique(number))


TOGGLE_KEY_LIST = Command("Show or hide this list", ("?", "f1"), Viewer.toggle_key_list)
TOGGLE_PANEL = Command("Show or hide the panel", ("h",), Viewer.toggle_panel)
FLY_OR_WALK = Command("Fly or walk", ("f",), lambda viewer: viewer.session.controller.toggle_walk())
ORBIT = Command("Orbit the point in view", ("o",), lambda viewer: viewer.session.controller.toggle_orbit())
RESET_CAMERA = Command("Return to the camera of the scene", ("home",), lambda viewer: viewer.session.reset_camera())
PAUSE = Command("Pause or continue", ("p",), lambda viewer: viewer.session.clock.toggle())
STEP = Command("Advance by 1/30 s", ("n",), lambda viewer: viewer.session.clock.step())
SLOWER = Command("Halve the speed of time", (",",), lambda viewer: viewer.session.clock.scale_rate(0.5))
FASTER = Command("Double the speed of time", (".",), lambda viewer: viewer.session.clock.scale_rate(2.0))
# the stroke under the brush is not a step of the history yet
UNDO = Command("Undo", ("ctrl+z",), lambda viewer: viewer.session.undo(), while_dragging=False)
REDO = Command("Redo", ("ctrl+shift+z", "ctrl+y"), lambda viewer: viewer.session.redo(), while_dragging=False)
OPEN = Command("Open a preset or a file", ("ctrl+o",), Viewer.ask_open)
SAVE = Command("Save the scene", ("ctrl+s",), Viewer.save)
SAVE_AS = Command("Save the scene as another file", ("ctrl+shift+s",), Viewer.ask_save_as)
SAVE_PICTURE = Command("Save a picture", ("f12",), Viewer.ask_picture)
RECORD_PATH = Command("Start or stop recording a camera path", ("f5",), lambda viewer: viewer.recorder.toggle_path())
PLAY_PATH = Command("Start or stop playing that path", ("f7",), lambda viewer: viewer.recorder.toggle_playback())
RECORD_VIDEO = Command("Start or stop recording a video", ("f6",), Viewer.toggle_video)
SPLIT = Command("Compare with the scene as it is now", ("c",), lambda viewer: viewer.session.split())
RELOAD = Command("Reload shaders and files", ("ctrl+r",), Viewer.reload_shaders)

COMMANDS = (
    TOGGLE_KEY_LIST,
    TOGGLE_PANEL,
    FLY_OR_WALK,
    ORBIT,
    RESET_CAMERA,
    PAUSE,
    STEP,
    SLOWER,
    FASTER,
    UNDO,
    REDO,
    OPEN,
    SAVE,
    SAVE_AS,
    SAVE_PICTURE,
    RECORD_PATH,
    PLAY_PATH,
    RECORD_VIDEO,
    SPLIT,
    RELOAD,
)
"""Commands in the order of the list of keys."""
TECHNIQUE_COMMANDS = tuple(map(_use_technique, range(1, 10)))
_BY_CHORD = {chord: command for command in (*COMMANDS, *TECHNIQUE_COMMANDS) for chord in command.keys}


def command_for(chord: str) -> Command | None:
    """Return the command of a chord, if it has one."""
    return _BY_CHORD.get(chord)
