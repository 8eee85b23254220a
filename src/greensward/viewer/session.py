"""What someone at the controls has before them: a scene and its past, time, an eye, a brush. No window, no GPU."""

import contextlib
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from greensward.ground import HeightField
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.techniques import TECHNIQUES, chosen
from greensward.viewer import saving
from greensward.viewer.brushes import Brush, Spot, Tool, canvas_of, handy, paint, track
from greensward.viewer.clock import Clock
from greensward.viewer.fields import Path as Keys
from greensward.viewer.fields import fresh, label_of, value_at, with_value
from greensward.viewer.history import History
from greensward.viewer.obstacles import Obstacles
from greensward.viewer.sun import sun_at
from greensward.viewer.walker import Walker

_MOST_FORCES = 8


@dataclass(frozen=True)
class Notice:
    """Something to tell; `bad` if it is a problem."""

    text: str
    bad: bool = False


class Session:
    """Everything that a person does to a scene, as calls.

    What cannot be done changes nothing and is told in `notices`.
    """

    def __init__(self, source: str = "meadow", scene: Scene | None = None) -> None:
        self.notices: list[Notice] = []
        self._scratch = tempfile.TemporaryDirectory(prefix="greensward-")
        self._painted = 0
        self.clock = Clock()
        self.tool: Tool = "look"
        self.stroke: list[Spot] = []
        """Where the brush has been since it touched the ground."""
        self.laid: list[Spot] = []
        """The last stroke, which is seen once the field is sown."""
        self._open(*(saving.opened(source) if scene is None else (scene, saving.Origin(source, None, None))))

    def _open(self, scene: Scene, origin: saving.Origin) -> None:
        chosen(scene)
        heights = HeightField.of(scene)
        self.origin, self.history, self._saved = origin, History(scene), scene
        self.compared: Scene | None = None
        """What the other half of a split window shows."""
        self._settings: dict[str, Any] = {}
        self._entered: Scene | None = None
        self.heights = heights
        self.brush = handy(scene) if heights.there else Brush()
        self.walker = Walker(scene.camera, heights)
        self._enter()
        self.clock.time_s = 0.0

    @property
    def scene(self) -> Scene:
        """The scene as it is now."""
        return self.history.scene

    @property
    def unsaved(self) -> bool:
        """Whether the scene differs from the file, or the preset, that it came from."""
        return self.scene != self._saved

    @property
    def would_be_lost(self) -> list[str]:
        """What leaving the scene now would lose, in words."""
        if self.unsaved:
            return [f"{self.name} has changes that are not saved."]
        gone = self.origin.file is not None and not saving.is_there(self.origin.file)
        return [f"{self.origin.file} is no longer there; what you see is all there is of it."] if gone else []

    @property
    def name(self) -> str:
        """What to call the scene."""
        return self.scene.title or self.origin.name

    def tell(self, text: str, bad: bool = False) -> None:
        """Put something into `notices`."""
        self.notices.append(Notice(text, bad))

    def close(self) -> None:
        """Forget what was painted and not saved."""
        self._scratch.cleanup()

    # Changing -----------------------------------------------------------------------------------------------

    def put(self, scene: Scene, what: str, drag: object = None) -> bool:
        """Take a changed scene; returns whether it can be had."""
        try:
            chosen(scene)
        except SceneError as error:
            for problem in error.problems:
                self.tell(problem.removeprefix("scene: "), bad=True)
            return False
        self.history.put(scene, what, drag)
        self._enter()
        return True

    def change(self, path: Keys, value: Any, drag: bool = False, what: str = "") -> bool:
        """Give a key of the scene another value. Values that follow each other in one `drag` are undone as one."""
        try:
            scene = with_value(self.scene, path, value)
        except SceneError as error:
            for problem in error.problems:
                self.tell(problem.removeprefix("scene: "), bad=True)
            return False
        return self.put(scene, what or _words(path), path if drag else None)

    def add(self, path: Keys, model: type[Any]) -> bool:
        """Add a table of this model to a list, near what is looked at."""
        at = self.walker.aim(8.0)
        near = float(at[0]), 0.0, float(at[2])
        try:
            table = fresh(model, tuple(round(x, 2) for x in near))  # type: ignore[arg-type]
        except ValueError as error:
            self.tell(f"{_words(path)}: cannot be added here ({error})", bad=True)
            return False
        held = value_at(self.scene, path)
        return self.change(path, (*held, table) if isinstance(held, tuple) else table)

    def remove(self, path: Keys) -> bool:
        """Take a table out of its list, or leave out one that may be missing."""
        if isinstance(path[-1], int):
            held = value_at(self.scene, path[:-1])
            return self.change(path[:-1], (*held[: path[-1]], *held[path[-1] + 1 :]))
        return self.change(path, None)

    def undo(self) -> None:
        """Take the last change back."""
        what = self.history.undoes
        if self.history.undo():
            self.tell(f"Undone: {what}")
            self._enter()

    def redo(self) -> None:
        """Do it again."""
        what = self.history.redoes
        if self.history.redo():
            self.tell(f"Done again: {what}")
            self._enter()

    def use_technique(self, name: str) -> bool:
        """Draw with another technique; its own settings are those that it had when it was last used."""
        choice = self.scene.technique
        if name == choice.name:
            return True
        self._settings[choice.name] = choice
        kept = self._settings.get(name) or type(choice)(name=name)
        return self.put(self.scene.model_copy(update={"technique": kept}).in_folder(self.folder), name)

    def use_nth_technique(self, number: int) -> bool:
        """Draw with the technique of this number, from 1."""
        return number <= len(TECHNIQUES) and self.use_technique(TECHNIQUES[number - 1].name)

    def set_hour(self, hour: float, drag: bool = True) -> None:
        """Put the sun where it stands at this hour of a day in May."""
        azimuth, elevation = sun_at(hour)
        sun = self.scene.sun.model_copy(
            update={"azimuth_deg": round(azimuth, 2), "elevation_deg": round(max(elevation, -10.0), 2)}
        )
        changed = self.scene.model_copy(update={"sun": sun}).in_folder(self.folder)
        self.put(changed, "time of day", "hour" if drag else None)

    def split(self) -> None:
        """Keep the scene as it is now beside what it becomes, or stop that."""
        self.compared = None if self.compared else self.scene

    @property
    def folder(self) -> Path:
        """Where the files that the scene names are looked for."""
        return self.scene.resolve(".")

    # Moving -------------------------------------------------------------------------------------------------

    def camera(self) -> Camera:
        """What the eye sees now."""
        return self.walker.camera()

    def keep_view(self) -> None:
        """Make what is seen now the scene's own camera."""
        if self.change(("camera",), self.camera().model_dump()):  # of plain values, which are checked
            self.tell("The scene opens with this view from now on.")

    def go_back(self) -> None:
        """Stand where the scene's camera is."""
        self.walker.look_from(self.scene.camera)

    def _enter(self) -> None:
        """Let the eye know of ground and objects, if they changed."""
        old, new = self._entered, self.scene
        same_ground = old is not None and old.ground == new.ground and old.seed == new.seed
        if old is not None and same_ground and (old.object, old.water) == (new.object, new.water):
            return
        try:
            if not same_ground:
                self.heights = HeightField.of(new)
            obstacles = Obstacles.of(new, self.heights)
        except GreenswardError as error:
            self.tell(str(error), bad=True)
            return
        self._entered = new
        water = new.water.level_m if new.water else float("-inf")
        self.walker.enter(self.heights, obstacles, water)

    def look_at_files_again(self) -> None:
        """Files that the scene names have changed, the ground's perhaps."""
        self._entered = None
        self._enter()

    # Painting -----------------------------------------------------------------------------------------------

    def touch(self, spot: Spot) -> None:
        """Put the brush on the ground, or draw it on to a spot, x and z."""
        last = self.stroke[-1] if self.stroke else None
        if last is None or (spot[0] - last[0]) ** 2 + (spot[1] - last[1]) ** 2 > (0.1 * self.brush.radius_m) ** 2:
            self.stroke.append((float(spot[0]), float(spot[1])))
            if self.tool == "press":
                self._press()

    def lift(self) -> None:
        """Take the brush off the ground: the stroke is done."""
        if self.stroke and self.tool in ("sow", "thin", "mow"):
            self._paint()
        self.stroke, self.laid = [], self.stroke
        self.history.seal()

    def _press(self) -> None:
        forces = self.scene.force
        drawing = self.history.undoes == "press" and len(self.stroke) > 1 and self._pressing
        kept = forces[:-1] if drawing else forces
        if len(kept) >= _MOST_FORCES:
            self.stroke = []
            self.tell(
                f"A scene has at most {_MOST_FORCES} [[force]] tables; remove one in the panel first.", bad=True
            )
            return
        self._pressing = True
        try:
            self.put(with_value(self.scene, ("force",), (*kept, track(self.stroke, self.brush))), "press", "press")
        except (SceneError, ValueError) as error:
            self.tell(f"That stroke is too long to be one track ({str(error).splitlines()[0]})", bad=True)
            self.stroke = []

    _pressing = False

    def _paint(self) -> None:
        tool = self.tool
        if not self.heights.there:
            self.tell("This scene has no ground to paint on.", bad=True)
            return
        try:
            canvas = canvas_of(self.scene)
            if not paint(canvas, self.scene.ground.size_m, self.stroke, tool, self.brush):
                full = "The grass is as dense here as `sowing.density_per_m2` allows; raise that in the panel."
                self.tell(full if tool == "sow" else "Nothing to change here.")
                return
            self._painted += 1
            path = Path(self._scratch.name) / f"density-{self._painted:03d}.png"
            saving.write_map(path, canvas)
        except GreenswardError as error:
            self.tell(str(error), bad=True)
            return
        self.change(("sowing", "density_map"), str(path), what=tool)

    # Files --------------------------------------------------------------------------------------------------

    def open(self, source: str) -> bool:
        """Open a preset or a file instead; the old scene stays if that fails."""
        try:
            scene, origin = saving.opened(source)
            self._open(scene, origin)
        except (GreenswardError, OSError) as error:
            self.tell(str(error), bad=True)
            return False
        return True

    def reload(self) -> bool:
        """Take what the scene's file holds now, as a change that can be undone; False, told, if it is broken."""
        if self.origin.file is None:
            return False
        try:
            scene, origin = saving.opened(str(self.origin.file))
        except (GreenswardError, OSError) as error:
            self.tell(str(error), bad=True)
            return False
        if not self.put(scene, "the file changed"):
            return False
        self.origin = replace(origin, name=self.origin.name)
        self._saved = scene
        return True

    def rescue(self) -> Path | None:
        """Before all ends, write what is not saved to a file of its own; None where nothing is, or nowhere can."""
        if not self.unsaved:
            return None
        here = self.origin.file.parent if self.origin.file else Path()
        for folder in (here, Path("~"), Path(tempfile.gettempdir())):
            with contextlib.suppress(OSError, RuntimeError):
                path = saving.free_name(folder.expanduser(), f"{self.origin.name}-rescued", ".toml")
                if self.save(path):
                    return path
        return None

    def save(self, path: Path | None = None) -> bool:
        """Write the scene to its file, or to another, which is its file from now on."""
        path = path or self.origin.file
        if path is None:
            self.tell("A preset is not written to: save it under a name of its own.", bad=True)
            return False
        # another file has comments of its own, which are not this scene's
        try:
            scene, text = saving.save(self.scene, path, self.origin.text)
        except (GreenswardError, OSError) as error:
            self.tell(str(error), bad=True)
            return False
        self.origin = saving.Origin(path.stem, path, text)
        self.history.settle(scene)
        self._saved = scene
        self.tell(f"Saved {path}")
        return True


def _words(path: Sequence[str | int]) -> str:
    """`wind 1, speed` for people, from the keys that lead to a value."""
    text = ""
    for part in path:
        text += f" {part + 1}" if isinstance(part, int) else f", {label_of(part)}" if text else label_of(part)
    return text
