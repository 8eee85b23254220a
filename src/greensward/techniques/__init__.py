"""HOW grass is drawn: one folder each, Python and GLSL together."""

from greensward.techniques.bezier_blades import BezierBlades
from greensward.techniques.technique import Technique

TECHNIQUES: tuple[type[Technique], ...] = (BezierBlades,)

SETTINGS = {technique.name: technique.Settings for technique in TECHNIQUES}

__all__ = ["SETTINGS", "TECHNIQUES", "Technique"]
