"""OpenGL contexts that share objects: one for the window, and one for each renderer."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import moderngl


class Slot:
    """Context lent to one renderer. If it is `separate`, another thread may build in it while others draw."""

    def __init__(self, ctx: moderngl.Context, enter: Callable[[], None], separate: bool) -> None:
        self.ctx, self.separate = ctx, separate
        self._enter = enter

    def enter(self) -> None:
        """Make the context current in this thread."""
        self._enter()


class Contexts:
    """Pool of contexts that share objects with that of the window.

    `make` returns a new context, which it leaves current, and a function that makes it current again; None on
    platforms with a single context. `leave` makes no context current in this thread.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        enter: Callable[[], None],
        make: Callable[[], tuple[moderngl.Context, Callable[[], None]]] | None = None,
        leave: Callable[[], None] = lambda: None,
    ) -> None:
        self.ctx = ctx
        self.leave = leave
        self._enter, self._make = enter, make
        self._free: list[Slot] = []

    def take(self) -> Slot:
        """Return a context for exclusive use until `give_back`."""
        if self._make is None:
            return Slot(self.ctx, self._enter, False)
        if not self._free:
            ctx, enter = self._make()
            # objects that a failed build leaves are freed while their context is current
            ctx.gc_mode = "context_gc"
            self._enter()
            self._free.append(Slot(ctx, enter, True))
        return self._free.pop()

    def give_back(self, slot: Slot) -> None:
        """Return a context to the pool."""
        if slot.separate:
            with self.within(slot):
                _free_garbage(slot.ctx)
            self._free.append(slot)

    @contextmanager
    def within(self, slot: Slot) -> Iterator[None]:
        """Make a context current inside, and that of the window afterwards; only in the thread of the window."""
        slot.enter()
        try:
            yield
        finally:
            self._enter()


def _free_garbage(ctx: moderngl.Context) -> None:
    """Free collected objects like `Context.gc`, which fails on objects that were released before."""
    while ctx.objects:
        if release := getattr(ctx.objects.popleft(), "release", None):
            release()
