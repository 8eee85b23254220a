"""How large the picture is drawn so that frames come as often as wished."""

SCALES = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)
"""Parts of the window's width and height that the picture may have; a change of size costs a frame or two."""
DETAILS = (1.0, 0.5, 0.25)
"""Parts of the scene's blades that may be drawn, most first."""
_PATIENCE_S = 0.6
_FEWEST = 4


class Pacing:
    """Picks the scale of the picture, and says when fewer blades are needed, from how long frames take."""

    def __init__(self, target_fps: float) -> None:
        self.target_fps = target_fps
        self.automatic = True
        self._at = SCALES.index(0.5)
        self._since_s, self._frames, self._spent_ms = 0.0, 0, 0.0
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
        before = self._at
        if mean_ms > 1.08 * budget_ms:
            self.too_slow = self._at == 0
            # at best all of the time goes with the pixels; at the least, one step
            wanted = self.scale * (budget_ms / mean_ms) ** 0.5
            self._at = max(0, min(self._at - 1, sum(scale <= wanted for scale in SCALES) - 1))
        elif self._at + 1 < len(SCALES):
            self.too_slow = False
            grown = (SCALES[self._at + 1] / self.scale) ** 2
            if mean_ms * grown < 0.92 * budget_ms:
                self._at += 1
        return self._at != before
