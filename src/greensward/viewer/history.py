"""Undo and redo of whole scenes, which are frozen values."""

from dataclasses import dataclass

from greensward.scene import Scene

_MOST = 500


@dataclass(frozen=True)
class _Step:
    scene: Scene
    label: str
    """Name of the change that led to the scene; empty for the first."""
    drag: object
    """Key of the drag in progress; steps of one drag are merged."""


class History:
    """Current scene, those before it, and those that were undone."""

    def __init__(self, scene: Scene) -> None:
        self._steps = [_Step(scene, "", None)]
        self._at = 0

    @property
    def scene(self) -> Scene:
        """Current scene."""
        return self._steps[self._at].scene

    @property
    def undo_label(self) -> str | None:
        """Name of the change that `undo` reverts; None at the first step."""
        return self._steps[self._at].label if self._at else None

    @property
    def redo_label(self) -> str | None:
        """Name of the change that `redo` repeats; None at the last step."""
        return self._steps[self._at + 1].label if self._at + 1 < len(self._steps) else None

    def push(self, scene: Scene, label: str, drag: object = None) -> None:
        """Add a step. Steps with the same `drag`, until `end_drag`, are merged into one."""
        if scene == self.scene:
            return
        last = self._steps[self._at]
        del self._steps[self._at + 1 :]
        if drag is not None and last.drag == drag:
            self._steps[self._at] = _Step(scene, label, drag)
            return
        self._steps.append(_Step(scene, label, drag))
        del self._steps[: max(0, len(self._steps) - _MOST)]
        self._at = len(self._steps) - 1

    def replace(self, scene: Scene) -> None:
        """Replace the current scene without a step: the same scene, whose files have other names."""
        self._steps[self._at] = _Step(scene, self._steps[self._at].label, None)

    def end_drag(self) -> None:
        """End a drag: the next change is a step of its own."""
        last = self._steps[self._at]
        self._steps[self._at] = _Step(last.scene, last.label, None)

    def undo(self) -> bool:
        """Go back a step; return False at the first."""
        return self._go(-1)

    def redo(self) -> bool:
        """Go forward a step; return False at the last."""
        return self._go(1)

    def _go(self, by: int) -> bool:
        self.end_drag()
        exists = 0 <= self._at + by < len(self._steps)
        self._at += by if exists else 0
        return exists
