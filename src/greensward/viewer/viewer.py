"""Session with the viewports that draw it, and all that the user interface shows and changes."""

import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from greensward.gpu.shader_source import forget_files
from greensward.renderer import Counts
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.scene.load import named_files
from greensward.techniques import SETTINGS
from greensward.viewer import saving
from greensward.viewer.camera_controller import Intent
from greensward.viewer.contexts import Contexts
from greensward.viewer.dialogs import Dialog, Dialogs
from greensward.viewer.dynamic_resolution import DynamicResolution
from greensward.viewer.file_watcher import FileWatcher, shader_files
from greensward.viewer.picking import Area, Picker
from greensward.viewer.pointer import Pointer
from greensward.viewer.preview import QUALITIES, preview
from greensward.viewer.recorder import Recorder
from greensward.viewer.session import Message, Session
from greensward.viewer.viewport import Viewport

Size = tuple[int, int]
PANEL_PX = 356
"""Width of the panel in points."""
_NARROWEST_PX = 640
_CPU_FPS, _GPU_FPS = 12.0, 60.0
_CPU_QUALITY = 0.125
_MESSAGE_S = 5.0
_MOST_MESSAGES = 6
_GRAPHED_FRAMES = 120
_LONGEST_STEP_S = 0.25
_COUNT_EVERY = 8  # counts wait for the GPU


class Viewer:
    """State that the user interface shows: session, viewports, pointer, recordings, dialogs and messages.

    It knows no toolkit; `Application` adds input and interface.
    """

    def __init__(self, contexts: Contexts, session: Session) -> None:
        self.session = session
        self._contexts = contexts
        self.viewports = [Viewport(contexts)]
        """Viewport of the current scene; in a split window, after that of the compared one."""
        self.software = self.viewports[0].software
        self.resolution = DynamicResolution(_CPU_FPS if self.software else _GPU_FPS)
        self.quality = _CPU_QUALITY if self.software else QUALITIES[0]
        """Preview quality: fraction of the blades that the viewports draw."""
        self._previews: list[tuple[Scene, float, Scene]] = []
        self.pointer = Pointer(session)
        self.picker = Picker(None, [(0, 0, 1, 1)])
        self.recorder = Recorder(session)
        self.dialogs = Dialogs()
        self.panel = True
        """Visibility of panel and tools."""
        self.timing = False
        """True while the times of passes are shown, and are measured for it."""
        self.pass_times: deque[dict[str, float]] = deque(maxlen=_GRAPHED_FRAMES)
        """Milliseconds by pass of the last frames."""
        self.counts = Counts()
        self.has_moved = self.has_turned = False
        """True once the user has used the controls, which need no hint from then on."""
        self.idle = False
        """True while nothing on the screen changes."""
        self.done = False
        """True once the window may close."""
        self.problems: tuple[str, ...] = ()
        """Errors in the scene file on the disk."""
        self._messages: list[tuple[float, Message]] = []
        self._shaders = FileWatcher(shader_files())
        self._files = FileWatcher()
        self._watched: Scene | None = None
        self._frames = 0
        self._camera: Camera = session.camera()

    # A frame ------------------------------------------------------------------------------------------------

    def advance(self, seconds: float, intent: Intent) -> None:
        """Advance time and camera by wall-clock seconds."""
        session = self.session
        session.clock.advance(seconds)
        session.controller.lens = session.scene.camera
        self.has_moved |= bool(intent.ahead or intent.right)
        self.has_turned |= intent.turn_px != (0.0, 0.0)
        session.controller.move(intent, min(seconds, _LONGEST_STEP_S))
        self.recorder.play(seconds)
        self._camera = session.camera()

    def pick(self, size: Size, free: bool) -> None:
        """Pick the item below the mouse in a window of this size; `free` means that no widget covers it."""
        self.picker = Picker.of(self._camera, self.session, self.areas(size))
        self.pointer.update(self.picker, free)

    def panel_px(self, width: int) -> int:
        """Return the width of the panel in a window of this width."""
        return min(PANEL_PX, width) if self.panel and width >= _NARROWEST_PX else 0

    def areas(self, size: Size) -> list[Area]:
        """Return the areas of the viewports in a window of this size, left first."""
        width = max(size[0] - self.panel_px(size[0]), 1)
        if len(self.viewports) == 1:
            return [(0, 0, width, max(size[1], 1))]
        half = max(width // 2, 1)
        return [(0, 0, half, max(size[1], 1)), (half, 0, max(width - half, 1), max(size[1], 1))]

    def draw(self, size: Size, content_scale: float, ui_ms: float) -> bool:
        """Draw the viewports that have changed; return True if any has.

        `ui_ms` is the time that the interface adds to a frame.
        """
        session, scale = self.session, self.resolution.scale * content_scale
        scenes = [session.scene] if session.compared is None else [session.compared, session.scene]
        while len(self.viewports) < len(scenes):
            # the left half is new: the current picture goes on at the right
            self.viewports.insert(0, Viewport(self._contexts))
        while len(self.viewports) > len(scenes):
            self.viewports.pop(0).release()
        drawn, took_ms = False, 0.0
        for viewport, scene, (_, _, width, height) in zip(self.viewports, scenes, self.areas(size), strict=True):
            pixels = max(round(scale * width), 1), max(round(scale * height), 1)
            viewport.show(self._preview(scene), self._camera, session.clock.time_s, pixels)
            if viewport.draw(self._camera, session.clock.time_s, pixels, timed=self.timing):
                drawn, took_ms = True, took_ms + viewport.took_ms
        if drawn:
            self._measure(took_ms + ui_ms)
        return drawn

    def _measure(self, took_ms: float) -> None:
        """Record the times and counts of a frame, and adapt resolution and quality to them."""
        self._frames += 1
        if self.timing:
            self.pass_times.append(self.viewports[-1].pass_ms)
            if self._frames % _COUNT_EVERY == 1:
                self.counts = self.viewports[-1].counts
        if self.building or self.recorder.recording_video:
            return
        self.resolution.frame(took_ms)
        if self.resolution.too_slow and self.quality > QUALITIES[-1]:
            self.quality = QUALITIES[QUALITIES.index(self.quality) + 1]
            self.resolution.too_slow = False

    def _preview(self, scene: Scene) -> Scene:
        """Return the scene at preview quality; the same object for the same scene."""
        for full, quality, reduced in self._previews:
            if full is scene and quality == self.quality:
                return reduced
        self._previews = [*self._previews[-3:], (scene, self.quality, preview(scene, self.quality))]
        return self._previews[-1][2]

    @property
    def building(self) -> bool:
        """True while any viewport builds a renderer."""
        return any(viewport.busy for viewport in self.viewports)

    def record(self, seconds: float) -> None:
        """Add the frame that was drawn to the recordings."""
        self.recorder.add(self._camera, self.viewports[-1], seconds)

    # Commands -----------------------------------------------------------------------------------------------

    def toggle_key_list(self) -> None:
        """Show or hide the list of keys."""
        self.has_moved = self.has_turned = True
        self.dialogs.key_list = not self.dialogs.key_list

    def toggle_panel(self) -> None:
        """Show or hide panel and tools."""
        self.panel = not self.panel

    def cancel(self) -> None:
        """Hide the list of keys, and put the brush away."""
        self.dialogs.key_list = False
        self.session.tool = "look"

    def reload_shaders(self) -> None:
        """Reload shaders and the files of the scene."""
        forget_files()
        for viewport in self.viewports:
            viewport.rebuild()

    def open(self, source: str) -> None:
        """Open a preset or a file."""
        if self.session.open(source):
            self.problems = ()

    def open_or_ask(self, source: str) -> None:
        """Open a preset or a file; ask first if changes would be lost."""
        if self.session.would_be_lost:
            self.dialogs.ask(Dialog.DISCARD, source)
        else:
            self.open(source)

    def ask_open(self) -> None:
        """Ask for the scene to open."""
        self.dialogs.ask(Dialog.OPEN)

    def save(self, then: Callable[[], None] = lambda: None) -> None:
        """Save the scene to its file, then call `then`.

        Without a file, ask for one; if another program has changed the file, ask before replacing it.
        """
        if self.session.origin.file is None:
            self.ask_save_as(then)
        elif saving.changed_elsewhere(self.session.origin):
            self.dialogs.ask(Dialog.REPLACE, then=then)
        elif self.session.save():
            then()

    def ask_save_as(self, then: Callable[[], None] = lambda: None) -> None:
        """Ask for the file to save to."""
        file = self.session.origin.file
        name = file or saving.free_name(Path(), self.session.origin.name, ".toml")
        self.dialogs.ask(Dialog.SAVE_AS, saving.printable(str(name)), then)

    def ask_picture(self) -> None:
        """Ask for file, size and samples of a picture."""
        self.dialogs.ask(Dialog.PICTURE, saving.printable(str(self.recorder.free_name(".png"))))

    def save_picture(self, path: Path, size: Size, samples: int) -> bool:
        """Start rendering the current view to a file; return True if the file can be written."""
        return self.recorder.render(self._camera, path, size, samples)

    def toggle_video(self) -> None:
        """Start or stop recording a video of the current viewport."""
        self.recorder.toggle_video(self.viewports[-1])

    def ask_leave(self) -> None:
        """Leave; ask first if something would be lost."""
        if self.would_be_lost:
            self.dialogs.ask(Dialog.LEAVE)
        else:
            self.done = True

    @property
    def would_be_lost(self) -> list[str]:
        """Sentences about the work that leaving now would lose."""
        return self.session.would_be_lost + self.recorder.would_be_lost

    # Files that change on the disk --------------------------------------------------------------------------

    def watch_files(self) -> None:
        """Reload shaders and files of the scene that have changed on the disk."""
        if changed := self._shaders.changed():
            self.session.notify(f"{changed[0].name} has changed: reloading the shaders")
            self.reload_shaders()
        session = self.session
        if self._watched is not session.scene:
            self._watched = session.scene
            file = session.origin.file
            self._files.watch([path for _, path in named_files(session.scene, SETTINGS)] + ([file] if file else []))
        changed = self._files.changed()
        if session.origin.file in changed:
            self._reload_scene(session.origin.file)
        elif changed:
            session.reload_files()
            for viewport in self.viewports:
                viewport.rebuild()

    def _reload_scene(self, file: Path) -> None:
        """Reload the scene file, which another program or this one has written."""
        session = self.session
        try:
            if saving.open_scene(str(file))[1].text == session.origin.text:
                self.problems = ()
                return
        except SceneError as error:
            self.problems = error.problems
            return
        except (GreenswardError, OSError) as error:
            self.problems = (str(error),)
            return
        self.problems = ()
        unsaved = session.unsaved
        if session.reload():
            session.notify(f"{file.name} has changed: reloaded" + ("; undo restores your changes" if unsaved else ""))

    # Messages -----------------------------------------------------------------------------------------------

    def update_messages(self, seconds: float) -> None:
        """Show the new messages of the session, and drop those that have been shown long enough."""
        self._messages = [(left_s - seconds, message) for left_s, message in self._messages if left_s > seconds]
        for message in self.session.messages:
            others = [each for each in self._messages if each[1].text != message.text]
            self._messages = [*others, (_MESSAGE_S * (2.0 if message.error else 1.0), message)][-_MOST_MESSAGES:]
        self.session.messages.clear()

    @property
    def messages(self) -> list[Message]:
        """Messages on show, oldest first."""
        return [message for _, message in self._messages]

    @property
    def shows_hint(self) -> bool:
        """True until the user has moved and turned the camera, or opened the list of keys."""
        return not (self.has_moved and self.has_turned)

    def building_s(self, viewport: Viewport) -> float:
        """Return the time since a viewport began to build its renderer, in seconds."""
        return time.perf_counter() - viewport.building_since if viewport.building_since else 0.0

    def release(self) -> None:
        """Stop recordings, and free the GPU resources and temporary files."""
        self.recorder.stop()
        for viewport in self.viewports:
            viewport.release()
        self.session.close()
