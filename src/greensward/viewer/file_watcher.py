"""Watch on files that may change while they are in use: the scene file, the files that it names, and the shaders."""

import os
import time
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

_EVERY_S = 0.4
_SHADERS = frozenset({".vert", ".tesc", ".tese", ".geom", ".frag", ".comp", ".glsl"})


class FileWatcher:
    """Watch on a set of files, which asks the file system a few times a second at most."""

    def __init__(self, paths: Iterable[Path] = ()) -> None:
        self._asked_s = time.monotonic()
        self._known: dict[Path, tuple[int, int] | None] = {}
        self.watch(paths)

    def watch(self, paths: Iterable[Path]) -> None:
        """Replace the set of files; those that were in it keep the state in which they were last seen."""
        known = self._known
        self._known = {path: known[path] if path in known else _stamp(path) for path in paths}

    def changed(self, now_s: float | None = None) -> list[Path]:
        """Return the files that have changed since they were last reported."""
        now_s = time.monotonic() if now_s is None else now_s
        if now_s - self._asked_s < _EVERY_S:
            return []
        self._asked_s = now_s
        found = []
        for path, before in self._known.items():
            # a missing file may be about to come back: editors write aside and rename
            if (stamp := _stamp(path)) != before and stamp is not None:
                self._known[path] = stamp
                found.append(path)
        return found


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = os.stat(path)  # noqa: PTH116
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size


def shader_files() -> list[Path]:
    """Return every shader of the package."""
    root = Path(str(files("greensward")))
    return sorted(path for path in root.rglob("*") if path.suffix in _SHADERS)
