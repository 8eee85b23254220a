"""Milliseconds per pass: GPU timer queries on hardware, the wall clock around `finish()` on software drivers."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl

from greensward.gpu.device import Device


class PassTimers:
    """Times named passes while enabled; costs nothing while not."""

    def __init__(self, device: Device) -> None:
        self.enabled = False
        self.queried = device.features.timer_queries
        """Times are the GPU's own; if not, they are those of the wall clock around `finish()`."""
        self._ctx = device.ctx
        self._queries: dict[str, list[moderngl.Query]] = {}
        self._used: dict[str, int] = {}
        self._wall: dict[str, float] = {}

    def start_frame(self) -> None:
        """Forget the last frame's times."""
        self._used = dict.fromkeys(self._queries, 0)
        self._wall = {}

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Time what is drawn inside. Passes must not nest: OpenGL has one elapsed-time query at a time."""
        if not self.enabled:
            yield
            return
        if not self.queried:
            # timer queries miss most of llvmpipe's work, which is done at the flush
            self._ctx.finish()
            started = time.perf_counter()
            yield
            self._ctx.finish()
        else:
            queries = self._queries.setdefault(name, [])
            used = self._used.get(name, 0)
            if used == len(queries):
                queries.append(self._ctx.query(time=True))
            self._used[name] = used + 1
            started = time.perf_counter()
            with queries[used]:
                yield
        self._wall[name] = self._wall.get(name, 0.0) + (time.perf_counter() - started) * 1e3

    def milliseconds(self) -> dict[str, float]:
        """Time of each pass of the last frame. Waits for the GPU."""
        if not self.queried:
            return dict(self._wall)
        return {
            name: sum(query.elapsed for query in self._queries[name][:used]) / 1e6
            for name, used in self._used.items()
            if used
        }

    def cpu_milliseconds(self) -> dict[str, float]:
        """Time that Python took to hand over each pass of the last frame; empty where the CPU itself draws them."""
        return dict(self._wall) if self.queried else {}
