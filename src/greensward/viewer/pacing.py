"""How large the picture is drawn so that frames come as often as wished."""

SCALES = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)
"""Parts of the window's width and height that the picture may have; a change of size costs a frame or two."""
DETAILS = (1.0, 0.5, 0.25, 0.125, 0.0625)
"""Parts of the scene's blades that may be drawn, most first."""
_PATIENCE_S = 0.6
_FEWEST = 4


class Pacing:
    """Picks the scale of the picture, and says when fewer blades are needed, from how long frames take.

    A part of that time goes with the number of pixels; how much shows when the scale changes.
    """

    def __init__(self, target_fps: float) -> None:
        self.target_fps = target_fps
        self.automatic = True
        self._at = SCALES.index(0.3 if target_fps < 20.0 else 1.0)
        self._since_s, self._frames, self._spent_ms = 0.0, 0, 0.0
        self._fixed = 0.5  # part of the time that stays whatever the scale
        self._before: tuple[float, float] | None = None
        self.too_slow = False
        """Whether even the smallest picture takes too long."""

    @property
    def scale(self) -> float:
        """Part of the window's width and height that the picture has."""
        return SCALES[self._at]

    @scale.setter
    def scale(self, scale: float) -> None:
        self._at = min(range(len(SCALES)), key=lambda i: abs(SCALES[i] - scale))
        self._restart()

    def _restart(self) -> None:
        self._since_s, self._frames, self._spent_ms = 0.0, 0, 0.0

    def _expected_ms(self, mean_ms: float, scale: float) -> float:
        return mean_ms * (self._fixed + (1.0 - self._fixed) * (scale / self.scale) ** 2)

    def frame(self, took_ms: float) -> bool:
        """Take note of a frame; whether the scale changed."""
        if not self.automatic:
            return False
        self._since_s += took_ms / 1e3
        self._frames += 1
        # the first after a change allocates
        self._spent_ms += took_ms if self._frames > 1 else 0.0
        if self._frames < _FEWEST or self._since_s < _PATIENCE_S:
            return False
        mean_ms, budget_ms = self._spent_ms / (self._frames - 1), 1e3 / self.target_fps
        self._restart()
        self._learn(mean_ms)
        before = self._at
        if mean_ms > 1.05 * budget_ms:
            self.too_slow = self._at == 0
            fitting = (i for i in range(self._at) if self._expected_ms(mean_ms, SCALES[i]) <= budget_ms)
            self._at = max(fitting, default=max(self._at - 2, 0))
        elif self._at + 1 < len(SCALES) and self._expected_ms(mean_ms, SCALES[self._at + 1]) < 0.9 * budget_ms:
            self.too_slow = False
            self._at += 1
        if self._at != before:
            self._before = SCALES[before], mean_ms
        return self._at != before

    def _learn(self, mean_ms: float) -> None:
        """See from a change of scale which part of the time went with it."""
        if self._before is None:
            return
        scale, before_ms = self._before
        self._before = None
        part = (mean_ms / before_ms - 1.0) / ((self.scale / scale) ** 2 - 1.0)
        self._fixed += 0.5 * (min(max(1.0 - part, 0.0), 0.9) - self._fixed)
