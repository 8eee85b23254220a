"""Names of the arrays of ground truth, which renderers call arbitrary output variables (AOVs)."""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Literal, get_args

Aov = Literal["depth", "normal", "class", "blade_id", "motion", "albedo"]
AOVS: tuple[Aov, ...] = get_args(Aov)


def unknown_aov(names: Iterable[str]) -> str | None:
    """Return the rule that the first unknown of these names breaks; None where all are known."""
    if isinstance(names, str):
        return unknown_aov([names]) or f'must be a list of names, such as ["{names}"] (got "{names}")'
    for name in names:
        if name not in AOVS:
            near = get_close_matches(str(name), AOVS, 1)
            fix = f"did you mean {near[0]}?" if near else f"choose from {', '.join(AOVS)}"
            return f"unknown output {name or 'without a name'}; {fix}"
    return None
