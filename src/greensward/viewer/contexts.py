"""OpenGL contexts that share what they hold: one for the window, and one for each renderer."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import moderngl


class Slot:
    """A context for one renderer at a time. With `apart` another thread may build in it while others draw."""

    def __init__(self, ctx: moderngl.Context, enter: Callable[[], None], apart: bool) -> None:
        self.ctx, self.apart = ctx, apart
        self._enter = enter

    def enter(self) -> None:
        """Make it the current context of this thread."""
        self._enter()


class Contexts:
    """Lends contexts that share objects with the one that shows the pictures.

    `make` returns a new one and how to make it current, and leaves it current; None where there can be only one.
    `leave` leaves none current in this thread.
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
        """A context that nobody else has, which is good until it is given back."""
        if self._make is None:
            return Slot(self.ctx, self._enter, False)
        if not self._free:
            ctx, enter = self._make()
            # what a failed build leaves behind is freed when its context is current again
            ctx.gc_mode = "context_gc"
            self._enter()
            self._free.append(Slot(ctx, enter, True))
        return self._free.pop()

    def give_back(self, slot: Slot) -> None:
        """Lend it to the next."""
        if slot.apart:
            with self.within(slot):
                _free_what_is_left(slot.ctx)
            self._free.append(slot)

    @contextmanager
    def within(self, slot: Slot) -> Iterator[None]:
        """Its context is current inside, and the shown one's again afterwards; for the thread of the window."""
        slot.enter()
        try:
            yield
        finally:
            self._enter()


def _free_what_is_left(ctx: moderngl.Context) -> None:
    """As `Context.gc`, which fails at objects that were released before they were forgotten."""
    while ctx.objects:
        if release := getattr(ctx.objects.popleft(), "release", None):
            release()
