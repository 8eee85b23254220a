"""Undo and redo of whole scenes, which are frozen values."""

from dataclasses import dataclass

from greensward.scene import Scene

_MOST = 500


@dataclass(frozen=True)
class _Step:
    scene: Scene
    what: str
    """What led to it, in words; empty for the first."""
    drag: object
    """What is being dragged, while it is; steps of one drag are one."""


class History:
    """The scene as it is, as it was, and as it was before it was undone."""

    def __init__(self, scene: Scene) -> None:
        self._steps = [_Step(scene, "", None)]
        self._at = 0

    @property
    def scene(self) -> Scene:
        """The scene as it is."""
        return self._steps[self._at].scene

    @property
    def undoes(self) -> str | None:
        """What `undo` would take back; None where there is nothing."""
        return self._steps[self._at].what if self._at else None

    @property
    def redoes(self) -> str | None:
        """What `redo` would do again."""
        return self._steps[self._at + 1].what if self._at + 1 < len(self._steps) else None

    def put(self, scene: Scene, what: str, drag: object = None) -> None:
        """The scene from now on. Steps with the same `drag`, until `seal`, count as one."""
        if scene == self.scene:
            return
        last = self._steps[self._at]
        del self._steps[self._at + 1 :]
        if drag is not None and last.drag == drag:
            self._steps[self._at] = _Step(scene, what, drag)
            return
        self._steps.append(_Step(scene, what, drag))
        del self._steps[: max(0, len(self._steps) - _MOST)]
        self._at = len(self._steps) - 1

    def settle(self, scene: Scene) -> None:
        """The same scene under other names of its files: no step of its own."""
        self._steps[self._at] = _Step(scene, self._steps[self._at].what, None)

    def seal(self) -> None:
        """End a drag: what follows is a step of its own."""
        last = self._steps[self._at]
        self._steps[self._at] = _Step(last.scene, last.what, None)

    def undo(self) -> bool:
        """Go back a step, if there is one."""
        return self._go(-1)

    def redo(self) -> bool:
        """Go forward a step, if one was undone."""
        return self._go(1)

    def _go(self, by: int) -> bool:
        self.seal()
        there = 0 <= self._at + by < len(self._steps)
        self._at += by if there else 0
        return there
