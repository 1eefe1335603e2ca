"""The exceptions that a user meets, each a sentence with the place, the value and the remedy."""

from collections.abc import Iterable


class InputError(ValueError):
    """Something the user gave is wrong; nothing has been run.

    `problems` lists every fault found, one sentence each.
    """

    def __init__(self, *problems: str):
        self.problems = problems
        super().__init__("\n".join(problems))


def refuse(problems: Iterable[str]) -> None:
    """Raises `InputError` where there are any."""
    if found := list(problems):
        raise InputError(*found)


class SimulationFailed(RuntimeError):
    """A run that left the finite numbers. `response` holds what had been computed before."""

    def __init__(self, message: str, response):
        self.response = response
        super().__init__(message)


class SimulationInterrupted(KeyboardInterrupt):
    """A run that was stopped before its end. `response` holds what had been computed before."""

    def __init__(self, message: str, response):
        self.response = response
        super().__init__(message)
