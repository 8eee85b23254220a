"""Errors in a user's input: place, rule, value and fix; one sentence each."""

from collections.abc import Iterable


class GreenswardError(Exception):
    """Error that a user can act on; the message is one readable sentence."""

    exit_code = 1


class InputError(GreenswardError):
    """Bad usage or bad input: nothing was drawn and nothing was written."""

    exit_code = 2


class SceneError(InputError):
    """Every error found in one scene, each a sentence with place, rule, value and fix."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))
