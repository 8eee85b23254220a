"""Files that may change while they are in use: the scene's own, those that it names, and the shaders."""

import os
import time
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

_EVERY_S = 0.4
_SHADERS = frozenset({".vert", ".tesc", ".tese", ".geom", ".frag", ".comp", ".glsl"})


class Watch:
    """Tells when any of some files has changed; asks the file system a few times a second at most."""

    def __init__(self, paths: Iterable[Path] = ()) -> None:
        self._asked_s = time.monotonic()
        self.put(paths)

    def put(self, paths: Iterable[Path]) -> None:
        """Watch these from now on: as they are now, or as they were where they are watched already."""
        known = getattr(self, "_known", {})
        self._known = {path: known[path] if path in known else _stamp(path) for path in paths}

    def changed(self, now_s: float | None = None) -> list[Path]:
        """Those that have changed since they were last told of."""
        now_s = time.monotonic() if now_s is None else now_s
        if now_s - self._asked_s < _EVERY_S:
            return []
        self._asked_s = now_s
        found = []
        for path, before in self._known.items():
            # a file that is away may be on its way back: editors write aside and rename
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
    """Every shader of the package."""
    root = Path(str(files("greensward")))
    return sorted(path for path in root.rglob("*") if path.suffix in _SHADERS)
