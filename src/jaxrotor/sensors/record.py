"""Measured signals: values over time, checked once."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from ..core.arguments import mapping, real_array, short, some_text
from ..core.errors import InputError
from ..machine.wiring import unknown


class Series:
    """One signal: `values` at the instants `t` (s, rising), in `unit`. A value that is not a number is
    missing: it counts for nothing. Instants may be unequally spaced; values may be complex (vectors, as a
    `TrackingFilter` shows them). Raises `InputError` for lengths that
    differ, instants that do not rise or are not finite, values that are infinite, and too few of them."""

    t: Float[np.ndarray, " n"]
    values: Float[np.ndarray, " n"] | Complex[np.ndarray, " n"]
    unit: str

    def __init__(self, t: Any, values: Any, unit: str = "", place: str = "a series"):
        self.t, self.values = (
            _numbers(t, f"{place}: instants"),
            _values(values, f"{place}: values"),
        )
        self.unit = some_text(unit, f"{place}: unit")
        if self.t.ndim != 1 or self.t.shape != self.values.shape:
            raise InputError(
                f"{place}: needs as many values as instants, in one row, but there are values "
                f"{self.values.shape} and instants {self.t.shape}"
            )
        if not np.isfinite(self.t).all():
            row = int(np.argmin(np.isfinite(self.t)))
            raise InputError(
                f"{place}: the instant in row {row + 1} is {self.t[row]:g}: every value needs its time: "
                "take such rows out"
            )
        falling = np.flatnonzero(np.diff(self.t) <= 0)
        if falling.size:
            row = int(falling[0]) + 1
            again = "again" if self.t[row] == self.t[row - 1] else "after"
            raise InputError(
                f"{place}: time must rise, but row {row + 1} is at {self.t[row]:.9g} s {again} "
                f"{self.t[row - 1]:.9g} s ({falling.size} such rows): sort the rows by time, and keep one "
                "of a kind"
            )
        if np.isinf(self.values).any():
            row = int(np.argmax(np.isinf(self.values)))
            raise InputError(
                f"{place}: the value in row {row + 1} is infinite: a missing one is written nan"
            )
        if self.valid.sum() < 4:
            raise InputError(
                f"{place}: has {int(self.valid.sum())} values; 4 at least are needed: is the right column "
                "named?"
            )

    @property
    def valid(self) -> np.ndarray:
        """Which values are there."""
        return np.isfinite(self.values)

    def scaled(self, size: float, unit: str, place: str) -> "Series":
        """The same in another unit."""
        return Series(self.t, size * self.values, unit, place)

    def __len__(self) -> int:
        return self.t.size

    def __repr__(self) -> str:
        missing = len(self) - int(self.valid.sum())
        gaps = f", {missing} missing" if missing else ""
        return f"Series({len(self)} values from {self.t[0]:g} to {self.t[-1]:g} s{gaps}, {self.unit!r})"


def _numbers(given: Any, place: str) -> np.ndarray:
    found = real_array(given)
    if found is None:
        raise InputError(f"{place} must be a row of numbers, but is {short(given)}")
    return found


def _values(given: Any, place: str) -> np.ndarray:
    if np.iscomplexobj(given):
        return np.asarray(given, complex)
    return _numbers(given, place)


class Record:
    """Signals recorded in one run of a machine, by the names of their channels; rates may differ.

    `name`: for messages and figures. `notes`: what was found out about the files it was read from.
    """

    series: dict[str, Series]
    name: str
    notes: tuple[str, ...]

    def __init__(self, series: Mapping[str, Series], name: str = "run", notes: Sequence[str] = ()):
        for key, one in mapping(series, f"`{name}`: series").items():
            if not isinstance(one, Series):
                raise InputError(
                    f"`{name}`: {key} must be a Series(t, values), but is {type(one).__name__}"
                )
        if not series:
            raise InputError(f"`{name}`: holds no signal")
        self.series, self.name, self.notes = dict(series), name, tuple(notes)

    def __getitem__(self, channel: str) -> Series:
        if channel not in self.series:
            raise InputError(f"`{self.name}`: {unknown('channel', channel, self.series)}")
        return self.series[channel]

    def __repr__(self) -> str:
        each = ", ".join(f"{k} {v!r}" for k, v in self.series.items())
        return "\n".join([f"Record({self.name!r}: {each})", *self.notes])

    @property
    def end(self) -> float:
        """The last instant, s."""
        return max(float(s.t[-1]) for s in self.series.values())
