"""What a user is told when an input is wrong: place, rule, value, cure; one sentence each."""

from collections.abc import Iterable


class GreenswardError(Exception):
    """A problem that a user can act on; the message is one readable sentence."""

    exit_code = 1


class InputError(GreenswardError):
    """Bad usage or bad input: nothing was drawn and nothing was written."""

    exit_code = 2


class SceneError(InputError):
    """Every problem found in one scene, each a sentence naming place, rule, value and cure."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(self.problems))
