"""The scene's time: it runs with the wall's, slower, faster, or a step at a time."""

SLOWEST, FASTEST = 0.02, 8.0
STEP_S = 1.0 / 30.0
_LONGEST_S = 0.25  # a window that stood still must not make the grass leap


class Clock:
    """Seconds since the scene's beginning."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.paused = False
        self.pace = 1.0
        """Seconds of the scene in a second."""
        self._steps = 0

    def advance(self, seconds: float) -> None:
        """Let so many seconds of the wall pass."""
        if self.paused:
            self.time_s += STEP_S * self._steps
        else:
            self.time_s += min(max(seconds, 0.0), _LONGEST_S) * self.pace
        self._steps = 0

    def step(self) -> None:
        """Pause, and go on by a thirtieth of a second."""
        self.paused = True
        self._steps += 1

    def faster(self, factor: float) -> None:
        """Change the pace."""
        self.pace = min(max(self.pace * factor, SLOWEST), FASTEST)
