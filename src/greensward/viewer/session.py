"""Viewer state: scene with undo history, clock, camera, brush. It needs no window and no GPU."""

import contextlib
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from greensward.ground import HeightField
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.scene.force import MOST_FORCES
from greensward.techniques import TECHNIQUES, chosen
from greensward.viewer import saving
from greensward.viewer.brushes import Brush, Point, Tool, initial_brush, paint, paintable_map, track
from greensward.viewer.camera_controller import CameraController
from greensward.viewer.clock import Clock
from greensward.viewer.fields import KeyPath, label_of, new_table, value_at, with_value
from greensward.viewer.history import History
from greensward.viewer.obstacles import Obstacles
from greensward.viewer.sun import sun_at


@dataclass(frozen=True)
class Message:
    """Message to the user: information, or an error."""

    text: str
    error: bool = False


class Session:
    """Viewer state: scene with undo history, clock, camera, brush.

    Its methods are the edits of a user. An edit that fails changes nothing and adds an error to `messages`.
    """

    def __init__(self, source: str = "meadow", scene: Scene | None = None) -> None:
        self.messages: list[Message] = []
        self._scratch = tempfile.TemporaryDirectory(prefix="greensward-")
        self._painted = 0
        self.clock = Clock()
        self.tool: Tool = "look"
        self.stroke: list[Point] = []
        """Points of the stroke in progress."""
        self.last_stroke: list[Point] = []
        """Last stroke, which is outlined until the field is sown."""
        self._open(*(saving.open_scene(source) if scene is None else (scene, saving.Origin(source, None, None))))

    def _open(self, scene: Scene, origin: saving.Origin) -> None:
        chosen(scene)
        heights = HeightField.of(scene)
        self.origin, self.history, self._saved = origin, History(scene), scene
        self.compared: Scene | None = None
        """Scene of the left half of a split window."""
        self._settings: dict[str, Any] = {}
        self._walked_scene: Scene | None = None
        self.heights = heights
        self.brush = initial_brush(scene) if heights.exists else Brush()
        self.controller = CameraController(scene.camera, heights)
        self._update_controller()
        self.clock.time_s = 0.0

    @property
    def scene(self) -> Scene:
        """Current scene."""
        return self.history.scene

    @property
    def unsaved(self) -> bool:
        """True if the scene differs from the file, or the preset, that it came from."""
        return self.scene != self._saved

    @property
    def would_be_lost(self) -> list[str]:
        """Sentences about the changes that leaving the scene now would lose."""
        if self.unsaved:
            return [f"{self.name} has changes that are not saved."]
        gone = self.origin.file is not None and not saving.exists(self.origin.file)
        return [f"{self.origin.file} no longer exists; leaving loses the scene."] if gone else []

    @property
    def name(self) -> str:
        """Title of the scene, or its file's name."""
        return self.scene.title or self.origin.name

    def notify(self, text: str, error: bool = False) -> None:
        """Add to `messages`."""
        self.messages.append(Message(text, error))

    def close(self) -> None:
        """Delete the temporary files: maps that were painted and not saved."""
        self._scratch.cleanup()

    # Changing -----------------------------------------------------------------------------------------------

    def apply(self, scene: Scene, label: str, drag: object = None) -> bool:
        """Replace the scene as a step of the history; return False if its technique cannot draw it."""
        try:
            chosen(scene)
        except SceneError as error:
            for problem in error.problems:
                self.notify(problem.removeprefix("scene: "), error=True)
            return False
        self.history.push(scene, label, drag)
        self._update_controller()
        return True

    def change(self, path: KeyPath, value: Any, drag: bool = False, label: str = "") -> bool:
        """Set a key of the scene; return False if the value is invalid. Values of one `drag` are undone together."""
        try:
            scene = with_value(self.scene, path, value)
        except SceneError as error:
            for problem in error.problems:
                self.notify(problem.removeprefix("scene: "), error=True)
            return False
        return self.apply(scene, label or _label(path), path if drag else None)

    def add(self, path: KeyPath, model: type[Any]) -> bool:
        """Add a table of this model to a list, near the point in view."""
        at = self.controller.target(8.0)
        near = float(at[0]), 0.0, float(at[2])
        try:
            table = new_table(model, tuple(round(x, 2) for x in near))  # type: ignore[arg-type]
        except ValueError as error:
            self.notify(f"{_label(path)}: cannot be added here ({error})", error=True)
            return False
        held = value_at(self.scene, path)
        return self.change(path, (*held, table) if isinstance(held, tuple) else table)

    def remove(self, path: KeyPath) -> bool:
        """Remove a table from its list, or an optional table."""
        if isinstance(path[-1], int):
            held = value_at(self.scene, path[:-1])
            return self.change(path[:-1], (*held[: path[-1]], *held[path[-1] + 1 :]))
        return self.change(path, None)

    def undo(self) -> None:
        """Revert the last change."""
        label = self.history.undo_label
        if self.history.undo():
            self.notify(f"Undone: {label}")
            self._update_controller()

    def redo(self) -> None:
        """Repeat the change that was undone last."""
        label = self.history.redo_label
        if self.history.redo():
            self.notify(f"Redone: {label}")
            self._update_controller()

    def use_technique(self, name: str) -> bool:
        """Switch the technique; each keeps its settings while others are in use."""
        choice = self.scene.technique
        if name == choice.name:
            return True
        self._settings[choice.name] = choice
        settings = self._settings.get(name) or type(choice)(name=name)
        return self.apply(self.scene.model_copy(update={"technique": settings}).in_folder(self.folder), name)

    def use_nth_technique(self, number: int) -> bool:
        """Switch to the technique of this number, from 1."""
        return number <= len(TECHNIQUES) and self.use_technique(TECHNIQUES[number - 1].name)

    def set_hour(self, hour: float, drag: bool = True) -> None:
        """Set the sun to its position at this hour of a day in May."""
        azimuth, elevation = sun_at(hour)
        sun = self.scene.sun.model_copy(
            update={"azimuth_deg": round(azimuth, 2), "elevation_deg": round(max(elevation, -10.0), 2)}
        )
        changed = self.scene.model_copy(update={"sun": sun}).in_folder(self.folder)
        self.apply(changed, "time of day", "hour" if drag else None)

    def split(self) -> None:
        """Compare the scene as it is now with later changes, or stop comparing."""
        self.compared = None if self.compared else self.scene

    @property
    def folder(self) -> Path:
        """Folder that the file names in the scene are relative to."""
        return self.scene.folder

    # Camera -------------------------------------------------------------------------------------------------

    def camera(self) -> Camera:
        """Return the current camera."""
        return self.controller.camera()

    def keep_view(self) -> None:
        """Make the current view the camera of the scene."""
        if self.change(("camera",), self.camera().model_dump()):  # plain values are validated
            self.notify("The scene now opens with this view.")

    def reset_camera(self) -> None:
        """Return to the camera of the scene."""
        self.controller.set_camera(self.scene.camera)

    def _update_controller(self) -> None:
        """Pass ground, objects and water to the camera controller if they changed."""
        old, new = self._walked_scene, self.scene

        def same(*names: str) -> bool:
            return old is not None and all(getattr(old, name) == getattr(new, name) for name in names)

        if same("ground", "seed", "object", "fence", "water"):
            return
        try:
            if not same("ground", "seed"):
                self.heights = HeightField.of(new)
            obstacles = Obstacles.of(new, self.heights)
        except GreenswardError as error:
            self.notify(str(error), error=True)
            return
        self._walked_scene = new
        water = new.water.level_m if new.water else float("-inf")
        self.controller.set_world(self.heights, obstacles, water)

    def reload_files(self) -> None:
        """Reload the files that the scene names, such as that of the ground."""
        self._walked_scene = None
        self._update_controller()

    # Painting -----------------------------------------------------------------------------------------------

    def extend_stroke(self, point: Point) -> None:
        """Start a stroke of the brush, or extend it to a point."""
        last = self.stroke[-1] if self.stroke else None
        if last is None or (point[0] - last[0]) ** 2 + (point[1] - last[1]) ** 2 > (0.1 * self.brush.radius_m) ** 2:
            self.stroke.append((float(point[0]), float(point[1])))
            if self.tool == "press":
                self._press()

    def end_stroke(self) -> None:
        """End the stroke, and apply it."""
        if self.stroke and self.tool in ("sow", "thin", "mow"):
            self._paint()
        self.stroke, self.last_stroke = [], self.stroke
        self.history.end_drag()

    def _press(self) -> None:
        forces = self.scene.force
        extending = self.history.undo_label == "press" and len(self.stroke) > 1 and self._pressing
        others = forces[:-1] if extending else forces
        if len(others) >= MOST_FORCES:
            self.stroke = []
            self.notify(
                f"A scene has at most {MOST_FORCES} [[force]] tables; remove one in the panel first.", error=True
            )
            return
        self._pressing = True
        try:
            self.apply(
                with_value(self.scene, ("force",), (*others, track(self.stroke, self.brush))), "press", "press"
            )
        except (SceneError, ValueError) as error:
            self.notify(f"The stroke is too long for one track ({str(error).splitlines()[0]})", error=True)
            self.stroke = []

    _pressing = False

    def _paint(self) -> None:
        tool = self.tool
        if not self.heights.exists:
            self.notify("The scene has no ground to paint on.", error=True)
            return
        try:
            density_map = paintable_map(self.scene)
            if not paint(density_map, self.heights.size_m, self.stroke, tool, self.brush):
                full = "The density here is `sowing.density_per_m2`, its maximum; raise that in the panel."
                self.notify(full if tool == "sow" else "The stroke changes nothing.")
                return
            self._painted += 1
            path = Path(self._scratch.name) / f"density-{self._painted:03d}.png"
            saving.write_map(path, density_map)
        except GreenswardError as error:
            self.notify(str(error), error=True)
            return
        self.change(("sowing", "density_map"), str(path), label=tool)

    # Files --------------------------------------------------------------------------------------------------

    def open(self, source: str) -> bool:
        """Open a preset or a file; return False, and keep the current scene, if that fails."""
        try:
            scene, origin = saving.open_scene(source)
            self._open(scene, origin)
        except (GreenswardError, OSError) as error:
            self.notify(str(error), error=True)
            return False
        return True

    def reload(self) -> bool:
        """Reload the scene file as a change that can be undone; return False if it is invalid."""
        if self.origin.file is None:
            return False
        try:
            scene, origin = saving.open_scene(str(self.origin.file))
        except (GreenswardError, OSError) as error:
            self.notify(str(error), error=True)
            return False
        if not self.apply(scene, "change of the file"):
            return False
        self.origin = replace(origin, name=self.origin.name)
        self._saved = scene
        return True

    def rescue(self) -> Path | None:
        """Write unsaved changes to a new file before the program ends; return its path, or None if there is none."""
        if not self.unsaved:
            return None
        beside = self.origin.file.parent if self.origin.file else Path()
        for folder in (beside, Path("~"), Path(tempfile.gettempdir())):
            with contextlib.suppress(OSError, RuntimeError):
                path = saving.free_name(folder.expanduser(), f"{self.origin.name}-rescued", ".toml")
                if self.save(path):
                    return path
        return None

    def save(self, path: Path | None = None) -> bool:
        """Write the scene to its file, or to another, which becomes its file."""
        path = path or self.origin.file
        if path is None:
            self.notify("A preset cannot be overwritten: save it under another name.", error=True)
            return False
        # another file has comments of its own, which are not this scene's
        try:
            scene, text = saving.save(self.scene, path, self.origin.text)
        except (GreenswardError, OSError) as error:
            self.notify(str(error), error=True)
            return False
        self.origin = saving.Origin(path.stem, path, text)
        self.history.replace(scene)
        self._saved = scene
        self.notify(f"Saved {path}")
        return True


def _label(path: Sequence[str | int]) -> str:
    """Return a label such as `wind 1, speed` for the path of a key."""
    text = ""
    for part in path:
        text += f" {part + 1}" if isinstance(part, int) else f", {label_of(part)}" if text else label_of(part)
    return text
