"""The exceptions that a user meets, each a sentence with the place, the value and the remedy: one family."""

from collections.abc import Iterable
from typing import Any


class JaxrotorError(Exception):
    """What jaxrotor raises. `problems` lists every fault found, one sentence each."""

    def __init__(self, *problems: str):
        self.problems = problems
        super().__init__("\n".join(problems))


class InputError(JaxrotorError, ValueError):
    """Something the user gave is wrong; nothing has been run."""


class MissingExtraError(JaxrotorError, ImportError):
    """An optional library is not installed; the sentence says which extra brings it."""


class StoreError(JaxrotorError, RuntimeError):
    """A sweep's store is damaged or cannot be read or written."""


class ConvergenceError(JaxrotorError, RuntimeError):
    """A search came to no end: no equilibrium, no periodic whirl, no step that is short enough, no start with
    finite numbers."""


class SimulationFailed(JaxrotorError, RuntimeError):
    """A run that left the finite numbers. `response` holds what had been computed before."""

    def __init__(self, message: str, response: Any):
        self.response = response
        super().__init__(message)


class SimulationInterrupted(KeyboardInterrupt):
    """A run that was stopped before its end. `response` holds what had been computed before."""

    def __init__(self, message: str, response: Any):
        self.response = response
        super().__init__(message)


def refuse(problems: Iterable[str]) -> None:
    """Raises `InputError` where there are any."""
    if found := list(problems):
        raise InputError(*found)
