"""Scene time: real time, slower, faster, or in single steps."""

SLOWEST, FASTEST = 0.02, 8.0
STEP_S = 1.0 / 30.0
_LONGEST_S = 0.25  # a window that stood still must not make the grass jump


class Clock:
    """Seconds since the start of the scene."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.paused = False
        self.rate = 1.0
        """Seconds of scene time per second."""
        self._steps = 0

    def advance(self, seconds: float) -> None:
        """Advance by wall-clock seconds."""
        if self.paused:
            self.time_s += STEP_S * self._steps
        else:
            self.time_s += min(max(seconds, 0.0), _LONGEST_S) * self.rate
        self._steps = 0

    def toggle(self) -> None:
        """Pause or continue."""
        self.paused = not self.paused

    def step(self) -> None:
        """Pause, and advance by 1/30 s."""
        self.paused = True
        self._steps += 1

    def scale_rate(self, factor: float) -> None:
        """Multiply the rate, within its limits."""
        self.rate = min(max(self.rate * factor, SLOWEST), FASTEST)
