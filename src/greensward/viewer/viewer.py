"""The viewer without its window: events in, a picture out. A window and a test drive it alike."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import moderngl

from greensward.gpu.program import forget_sources
from greensward.renderer import Counts
from greensward.scene import Camera, GreenswardError, Scene, SceneError
from greensward.scene.load import named_files
from greensward.viewer import controls, saving
from greensward.viewer.brushes import Tool
from greensward.viewer.contexts import Contexts
from greensward.viewer.draft import drafted
from greensward.viewer.face import Face
from greensward.viewer.hand import Hand, Sight
from greensward.viewer.pacing import DETAILS, Pacing
from greensward.viewer.pane import Pane
from greensward.viewer.recorder import Recorder
from greensward.viewer.session import Session
from greensward.viewer.watching import Watch, shader_files

Size = tuple[int, int]
_CPU_FPS, _GPU_FPS = 12.0, 60.0
_CPU_DETAIL = 0.125
_TOLD_S = 5.0
_NOT_WHILE_BUSY = frozenset({"undo", "redo"})  # what is under the brush is not a step yet


class Viewer:
    """A session, what draws it, and what is shown around it."""

    def __init__(self, contexts: Contexts, session: Session) -> None:
        self.session = session
        self._contexts = contexts
        self.panes = [Pane(contexts)]
        self.face = Face()
        self.pacing = Pacing(_CPU_FPS if self.panes[0].software else _GPU_FPS)
        self.detail = _CPU_DETAIL if self.panes[0].software else DETAILS[0]
        self.held = controls.Held()
        self.done = False
        """Whether the window may go."""
        self.hand = Hand(session)
        self._walked = self._looked = False
        self.resting = False
        """Whether nothing changes on the screen."""
        self.counts = Counts()
        self.problems: tuple[str, ...] = ()
        """What is wrong with the file on the disk."""
        self._waiting: list[controls.Event] = []
        self._told: list[tuple[float, str, bool]] = []
        self._shaders = Watch(shader_files())
        self._files = Watch()
        self._watched: Scene | None = None
        self.recorder = Recorder(session)
        self._frames = 0
        self._face_ms = 0.0
        self._size: Size = (1, 1)
        self._zoom = 1.0
        self._camera: Camera = session.camera()
        self.sight = Sight(None, [(0, 0, 1, 1)])
        """What is seen where."""
        self._drafts: list[tuple[Scene, float, Scene]] = []

    # A frame ------------------------------------------------------------------------------------------------

    def frame(
        self,
        seconds: float,
        events: Sequence[controls.Event],
        size: Size,
        target: moderngl.Framebuffer,
        zoom: float = 1.0,
    ) -> None:
        """Take events, go on by some seconds of the wall, and draw the window's content.

        Its size and places in it are in points; the framebuffer has `zoom` times as many pixels.
        """
        self._size, self._zoom = size, zoom
        self._waiting += events
        now = controls.one_by_one(self._waiting)
        for event in self._waiting[:now]:
            self._take(event)
        del self._waiting[:now]
        self._watch()
        session = self.session
        session.clock.advance(seconds)
        session.walker.lens = session.scene.camera
        intent = self.held.intent(self.hand.turned())
        self._walked |= bool(intent.ahead or intent.right)
        self._looked |= intent.turn_px != (0.0, 0.0)
        session.walker.move(intent, min(seconds, 0.25))
        self.recorder.play(seconds)
        self._camera = session.camera()
        self.sight = Sight.of(self._camera, session, self.areas(size))
        self.hand.reach(self.sight, free=not self.face.wants_mouse)
        drawn = self._draw_pictures()
        self.recorder.take(self._camera, self.panes[-1], seconds)
        self._gather(seconds)
        began = time.perf_counter()
        self.face.draw(self, seconds, size, target, zoom)
        if self.panes[0].software:
            self._contexts.ctx.finish()
        self._face_ms += 0.2 * (1e3 * (time.perf_counter() - began) - self._face_ms)
        self.resting = (
            not drawn
            and not events
            and not self._waiting
            and not any(pane.busy for pane in self.panes)
            and not self.recorder.working
        )

    def areas(self, size: Size) -> list[tuple[int, int, int, int]]:
        """Where pictures lie in the window: x, y, width and height in points."""
        width = max(size[0] - self.face.panel_px(size[0]), 1)
        if len(self.panes) == 1:
            return [(0, 0, width, max(size[1], 1))]
        half = max(width // 2, 1)
        return [(0, 0, half, max(size[1], 1)), (half, 0, max(width - half, 1), max(size[1], 1))]

    def _draw_pictures(self) -> bool:
        session, scale = self.session, self.pacing.scale * self._zoom
        wanted = [session.scene] if session.compared is None else [session.compared, session.scene]
        while len(self.panes) < len(wanted):
            # the left half is new: what is shown goes on, at the right
            self.panes.insert(0, Pane(self._contexts))
        while len(self.panes) > len(wanted):
            self.panes.pop(0).release()
        drawn, took_ms = False, 0.0
        areas = self.areas(self._size)
        for pane, scene, (_, _, width, height) in zip(self.panes, wanted, areas, strict=True):
            size = max(round(scale * width), 1), max(round(scale * height), 1)
            pane.show(self._drafted(scene), self._camera, session.clock.time_s, size)
            if pane.draw(self._camera, session.clock.time_s, size, timed=self.face.timing):
                drawn, took_ms = True, took_ms + pane.took_ms
        if drawn:
            self._frames += 1
            if self.face.timing:
                self.face.frame_page.took(self.panes[-1].pass_ms)
                if self._frames % 8 == 1:
                    self.counts = self.panes[-1].counts
            if not any(pane.busy for pane in self.panes) and not self.recorder.films:
                self.pacing.frame(took_ms + self._face_ms)
                self._draw_less()
        return drawn

    def _draw_less(self) -> None:
        if self.pacing.too_slow and self.detail > DETAILS[-1]:
            self.choose_detail(DETAILS[DETAILS.index(self.detail) + 1])
            self.pacing.too_slow = False

    def choose_detail(self, detail: float) -> None:
        """Draw this part of the scene's blades from now on."""
        self.detail = detail

    def _drafted(self, scene: Scene) -> Scene:
        """The scene as it is drawn here; the same object for the same scene."""
        for whole, detail, less in self._drafts:
            if whole is scene and detail == self.detail:
                return less
        self._drafts = [*self._drafts[-3:], (scene, self.detail, drafted(scene, self.detail))]
        return self._drafts[-1][2]

    # Mouse and keys -----------------------------------------------------------------------------------------

    def _take(self, event: controls.Event) -> None:
        match event:
            case controls.Move(x, y):
                self.hand.move(x, y)
                if self.hand.captured:
                    return
            case controls.Click(button, down):
                if self._click(button, down):
                    return
            case controls.Wheel(y) if not self.face.wants_mouse:
                self.hand.wheel(y, pace=self.held.ctrl)
                return
            case controls.Press(key, down, again):
                if down and not self.face.wants_keys and not again:
                    self.held.take(event)
                    self._key(key)
                elif not down or not self.face.wants_keys:
                    self.held.take(event)
            case controls.Pad() | controls.Blur():
                self.held.take(event)
            case controls.Close():
                self.ask_leave()
            case controls.Drop(path):
                self.open_or_ask(path)
        if self.face.wants_keys:
            self.held.clear()
        self.face.feed(event)

    def _key(self, key: str) -> None:
        if key == "escape":
            self.face.dialogs.help = False
            self.session.tool = "look"
        action = controls.action_for(self.held.chord(key))
        if action is None or (self.hand.busy and action in _NOT_WHILE_BUSY):
            return
        if action.startswith("technique "):
            self.session.use_nth_technique(int(action.split()[1]))
        else:
            self.act(action)

    def _click(self, button: controls.Button, down: bool) -> bool:
        """Whether the click was the picture's own."""
        if not down:
            return self.hand.release()
        if self.face.wants_mouse or self.face.dialogs.open:
            return False
        self.hand.press(button)
        return True

    def choose_tool(self, tool: Tool) -> None:
        """Take another tool into the hand."""
        self.session.tool = tool

    # What keys and buttons do -------------------------------------------------------------------------------

    def act(self, name: str) -> None:
        """Do what a key or a button is for: an `Action.name`."""
        getattr(self, name)()

    def toggle_help(self) -> None:
        """Show or hide the list of keys."""
        self._walked = self._looked = True
        self.face.dialogs.help = not self.face.dialogs.help

    def toggle_panel(self) -> None:
        """Show or hide panel and tools."""
        self.face.panel = not self.face.panel

    def fly_or_walk(self) -> None:
        """Change between the two."""
        self.session.walker.choose("walk" if self.session.walker.mode != "walk" else "fly")

    def orbit(self) -> None:
        """Circle around what is looked at, or walk on."""
        self.session.walker.choose("orbit" if self.session.walker.mode != "orbit" else "fly")

    def go_back(self) -> None:
        """Stand where the scene's camera is."""
        self.session.go_back()

    def pause(self) -> None:
        """Stop time, or let it run."""
        self.session.clock.paused = not self.session.clock.paused

    def step(self) -> None:
        """Go on by a thirtieth of a second."""
        self.session.clock.step()

    def slower(self) -> None:
        """Half as fast."""
        self.session.clock.faster(0.5)

    def faster(self) -> None:
        """Twice as fast."""
        self.session.clock.faster(2.0)

    def undo(self) -> None:
        """Take the last change back."""
        self.session.undo()

    def redo(self) -> None:
        """Do it again."""
        self.session.redo()

    def split(self) -> None:
        """Keep the scene as it is beside what it becomes, or stop that."""
        self.session.split()

    def reload_shaders(self) -> None:
        """Read shaders and the scene's files again."""
        forget_sources()
        for pane in self.panes:
            pane.rebuild()

    # Files --------------------------------------------------------------------------------------------------

    def open(self, source: str) -> None:
        """Open a preset or a file."""
        if self.session.open(source):
            self.problems = ()

    def open_or_ask(self, source: str) -> None:
        """Open it, after asking where changes would be lost."""
        if self.session.would_be_lost:
            self.face.dialogs.ask("discard", source)
        else:
            self.open(source)

    def ask_open(self) -> None:
        """Ask what to open."""
        self.face.dialogs.ask("open")

    def save(self, then: Callable[[], None] = lambda: None) -> None:
        """Save to the scene's file, or ask for one, and where someone else wrote it; `then` follows what is saved."""
        if self.session.origin.file is None:
            self.ask_save_as(then)
        elif saving.changed_elsewhere(self.session.origin):
            self.face.dialogs.ask("replace", then=then)
        elif self.session.save():
            then()

    def ask_save_as(self, then: Callable[[], None] = lambda: None) -> None:
        """Ask where to save."""
        file = self.session.origin.file
        name = file or saving.free_name(Path(), self.session.origin.name, ".toml")
        self.face.dialogs.ask("save", saving.legible(str(name)), then)

    def picture(self) -> None:
        """Ask for a picture's size."""
        self.face.dialogs.ask("picture", saving.legible(str(self.recorder.free_name(".png"))))

    def draw_picture(self, path: Path, size: Size, samples: int) -> bool:
        """Begin a picture of what is seen now; returns whether it can be written."""
        return self.recorder.draw(self._camera, path, size, samples)

    def record_path(self) -> None:
        """Record the way from now on, or stop and write it."""
        self.recorder.toggle_way()

    def play_path(self) -> None:
        """Go the recorded way again, or stop."""
        self.recorder.toggle_playing()

    def record_video(self) -> None:
        """Record what is seen from now on, or stop."""
        self.recorder.toggle_video(self.panes[-1])

    def ask_leave(self) -> None:
        """Leave, after asking where something would be lost."""
        if self.would_be_lost:
            self.face.dialogs.ask("leave")
        else:
            self.done = True

    @property
    def would_be_lost(self) -> list[str]:
        """What leaving now would lose, in words."""
        return self.session.would_be_lost + self.recorder.would_be_lost

    # The disk -----------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        if changed := self._shaders.changed():
            self.session.tell(f"{changed[0].name} has changed: reading shaders again")
            self.reload_shaders()
        session = self.session
        if self._watched is not session.scene:
            self._watched = session.scene
            file = session.origin.file
            self._files.put([path for _, path in named_files(session.scene)] + ([file] if file else []))
        changed = self._files.changed()
        if session.origin.file in changed:
            self._read_again(session.origin.file)
        elif changed:
            session.look_at_files_again()
            for pane in self.panes:
                pane.rebuild()

    def _read_again(self, file: Path) -> None:
        """The scene's file was written by someone else, or by us."""
        session = self.session
        try:
            if saving.opened(str(file))[1].text == session.origin.text:
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
            session.tell(
                f"{file.name} has changed: read again" + ("; undo brings back what you had" if unsaved else "")
            )

    def _gather(self, seconds: float) -> None:
        """Show each notice for a while."""
        self._told = [(left - seconds, text, bad) for left, text, bad in self._told if left > seconds]
        for notice in self.session.notices:
            kept = [each for each in self._told if each[1] != notice.text]
            self._told = [*kept, (_TOLD_S * (2.0 if notice.bad else 1.0), notice.text, notice.bad)][-6:]
        self.session.notices.clear()

    @property
    def is_new(self) -> bool:
        """Whether someone has not walked or not looked around yet, nor asked for the keys."""
        return not (self._walked and self._looked)

    @property
    def told(self) -> list[tuple[str, bool]]:
        """Notices on show, and whether each is a problem."""
        return [(text, bad) for _, text, bad in self._told]

    def building_s(self, pane: Pane) -> float:
        """How long a renderer has been in the making."""
        return time.perf_counter() - pane.building_since if pane.building_since else 0.0

    def release(self) -> None:
        """Stop what goes on and free everything."""
        self.recorder.stop()
        for pane in self.panes:
            pane.release()
        self.face.release()
        self.session.close()
