"""Errors in a user's input: place, rule, value and fix; one sentence each."""

from collections.abc import Iterable

_MOST_TOLD = 20


class GreenswardError(Exception):
    """Error that a user can act on; the message is one readable sentence."""

    exit_code = 1


class InputError(GreenswardError):
    """Bad usage or bad input: nothing was drawn and nothing was written."""

    exit_code = 2


class SceneError(InputError):
    """Every error found in one scene, each a sentence with place, rule, value and fix; the text has the first 20.

    `untold`: number of those beyond the first thousand of a table.
    """

    def __init__(self, problems: Iterable[str], untold: int = 0) -> None:
        self.problems = tuple(problems)
        more = len(self.problems) + untold - _MOST_TOLD
        told = (*self.problems[:_MOST_TOLD], *([f"and {more:,} more problems"] if more > 0 else []))
        super().__init__("\n".join(told))
