"""Dynamic resolution: the picture is scaled so that frames keep a target rate."""

SCALES = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)
"""Scales of the picture relative to the window; a change of size costs a frame or two."""
_PATIENCE_S = 0.6
_FEWEST = 4


class DynamicResolution:
    """Choice of the picture's scale from frame times, with a flag for scenes that are too slow at any scale.

    A part of the frame time grows with the number of pixels; it is estimated from changes of scale.
    """

    def __init__(self, target_fps: float) -> None:
        self.target_fps = target_fps
        self.automatic = True
        self._at = SCALES.index(0.3 if target_fps < 20.0 else 1.0)
        self._since_s, self._frames, self._spent_ms = 0.0, 0, 0.0
        self._fixed = 0.5  # fraction of the time that does not depend on the scale
        self._before: tuple[float, float] | None = None
        self.too_slow = False
        """True if even the smallest scale misses the target."""

    @property
    def scale(self) -> float:
        """Scale of the picture relative to the window, per axis."""
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
        """Record the time of a frame; return True if the scale changed."""
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
        self._estimate_fixed(mean_ms)
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

    def _estimate_fixed(self, mean_ms: float) -> None:
        """Estimate from a change of scale the fraction of the time that does not depend on it."""
        if self._before is None:
            return
        scale, before_ms = self._before
        self._before = None
        per_pixel = (mean_ms / before_ms - 1.0) / ((self.scale / scale) ** 2 - 1.0)
        self._fixed += 0.5 * (min(max(1.0 - per_pixel, 0.0), 0.9) - self._fixed)
