"""What is minimised, and what is bounded."""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from ..core.errors import InputError

Sense = Literal["<=", ">=", "=="]


class Judging(abc.ABC):
    """Sums, multiples and bounds of what judges a design."""

    @abc.abstractmethod
    def criterion(self) -> "Criterion":
        """What is minimised or bounded of it."""

    def __add__(self, other: Any) -> "Criterion":
        return Criterion(self.criterion().terms + as_criterion(other).terms)

    def __mul__(self, factor: float) -> "Criterion":
        if isinstance(factor, bool) or not np.isscalar(factor) or not np.isfinite(float(factor)):  # pyright: ignore
            raise InputError(f"a criterion is weighed by a finite number, but by {factor!r}")
        own = self.criterion().terms
        return Criterion(tuple((float(factor) * w, *rest) for w, *rest in own))  # pyright: ignore

    __rmul__ = __mul__

    def __neg__(self) -> "Criterion":
        return self * -1.0

    def __sub__(self, other: Any) -> "Criterion":
        return self + -as_criterion(other)

    def __le__(self, limit: float) -> "Constraint":
        return Constraint(self.criterion(), "<=", _finite(limit))

    def __ge__(self, limit: float) -> "Constraint":
        return Constraint(self.criterion(), ">=", _finite(limit))

    def equal_to(self, value: float) -> "Constraint":
        return Constraint(self.criterion(), "==", _finite(value))


def _finite(limit: Any) -> float:
    try:
        number = float(limit)
    except (TypeError, ValueError):
        raise InputError(f"a limit must be one number in SI units, but is {limit!r}") from None
    if not np.isfinite(number):
        raise InputError(f"a limit must be finite, but is {number}")
    return number


@dataclasses.dataclass(frozen=True, eq=False)
class Criterion(Judging):
    """A weighted sum of what measures say of experiments: `start.measure(...) + 0.1 * other`. `terms`:
    (weight, experiment, measure, how a batch counts); without an experiment the machine itself is judged."""

    terms: tuple[tuple[float, Any, Callable[[Any], Any], str], ...]

    def criterion(self) -> "Criterion":
        return self

    @property
    def unit(self) -> str:
        """Of a single measure; of a sum where all agree, else nothing."""
        units = {getattr(measure, "unit", "") for _, _, measure, _ in self.terms}
        return units.pop() if len(units) == 1 else ""

    def __str__(self) -> str:
        parts = []
        for weight, experiment, measure, over in self.terms:
            words = described(measure)
            if experiment is not None and experiment.variations is not None:
                words = f"{over} {words}"
            parts.append(words if weight == 1 else f"{weight:g} {words}")
        return " + ".join(parts)

    __repr__ = __str__


@dataclasses.dataclass(frozen=True, eq=False)
class Constraint:
    """`criterion` at most, at least or equal to `limit`, in its own unit."""

    criterion: Criterion
    sense: Sense
    limit: float

    def __str__(self) -> str:
        return f"{self.criterion} {self.sense} {self.limit:g} {self.criterion.unit}".rstrip()

    __repr__ = __str__


def as_criterion(given: Any) -> Criterion:
    """A criterion as it is; a function of the machine becomes one."""
    if isinstance(given, Judging):
        return given.criterion()
    if callable(given) and not isinstance(given, type):
        return Criterion(((1.0, None, given, "worst"),))
    raise InputError(
        "what is judged must be made by an experiment's `measure(...)`, be a measure of the machine, or a "
        f"function of it, but is {given!r} ({type(given).__name__})"
    )


def described(measure: Any) -> str:
    """`RootMeanSquare(Twist(main, end))`: the words in it, not its numbers."""
    if not dataclasses.is_dataclass(measure):
        name = getattr(measure, "__name__", type(measure).__name__)
        return "function" if name == "<lambda>" else name
    words = []
    for field in dataclasses.fields(measure):
        value = getattr(measure, field.name)
        if dataclasses.is_dataclass(value):
            words.append(described(value))
        elif isinstance(value, str) and value and field.name not in ("unit", "about", "at"):
            words.append(value)
        elif isinstance(value, tuple) and value and all(isinstance(v, str) for v in value):
            words.extend(value)
    inside = f"({', '.join(words)})" if words else ""
    return type(measure).__name__ + inside
