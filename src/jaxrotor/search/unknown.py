"""Parameters that are looked for, by name: where they start, what they may be, how they hang together."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ..core.arguments import listed, mapping, number, numbers, positive, some_text, text
from ..core.errors import InputError
from ..core.gate import takes
from ..machine.paths import split_entry

Kind = Literal["free", "positive", "bounded", "circular"]


@takes(
    path=some_text,
    start=number(),
    bounds=numbers(size=2),
    prior=numbers(size=2),
    scale=positive(),
    also=mapping,
)
@dataclasses.dataclass(frozen=True)
class Unknown:
    """A parameter that is looked for.

    **Arguments:**

    - `path`: `"main.unbalance.eccentricity"`; one entry of several as `"bearing.stiffness[0]"`. Channels'
      parameters likewise: `"probe.delay"`, `"probe.sensitivity"`.
    - `start`: where the search starts, SI; by default what the machine has.
    - `positive`: it is searched for by its logarithm. `bounds`: (lowest, highest), neither ever reached.
      `circular`: an angle, rad; reported from -pi to pi. At most one of the three.
    - `prior`: (mean, standard deviation) known beforehand, as one more measurement.
    - `scale`: a change of it that matters, for what is neither positive, bounded nor circular; by default the
      size of its start.
    - `also`: path -> factor of parameters tied to it: `{"right.stiffness": 1.0}` for two equal bearings.
    """

    path: str
    start: float | None = None
    positive: bool = False
    bounds: tuple[float, float] | None = None
    circular: bool = False
    prior: tuple[float, float] | None = None
    scale: float | None = None
    also: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def kind(self) -> Kind:
        if self.positive:
            return "positive"
        if self.bounds is not None:
            return "bounded"
        return "circular" if self.circular else "free"

    def checked(self, start: float) -> "Unknown":
        """With its start and its scale filled in; raises `InputError` where they do not fit."""
        if sum((self.positive, self.bounds is not None, self.circular)) > 1:
            raise InputError(f"`{self.path}`: choose one of positive, bounds and circular")
        if not math.isfinite(start):
            raise InputError(f"`{self.path}`: start must be finite, but is {start:g}")
        if self.positive and not start > 0:
            raise InputError(
                f"`{self.path}`: is looked for as a positive number, but starts at {start:g}: give "
                "`start` a positive one"
            )
        if self.bounds is not None:
            low, high = self.bounds
            if not low < high:
                raise InputError(f"`{self.path}`: bounds must rise, but are {low:g} and {high:g}")
            if not low < start < high:
                raise InputError(
                    f"`{self.path}`: starts at {start:g}, which is not between its bounds {low:g} and "
                    f"{high:g}"
                )
        if self.prior is not None and not self.prior[1] > 0:
            raise InputError(
                f"`{self.path}`: the standard deviation of its prior must be positive, but is "
                f"{self.prior[1]:g}"
            )
        scale = abs(start) if self.scale is None else self.scale
        if self.kind == "free" and not scale > 0:
            raise InputError(
                f"`{self.path}`: starts at zero: give `scale`, a change of it that matters"
            )
        return dataclasses.replace(
            self, start=float(start), scale=float(scale) if scale > 0 else 1.0
        )


def as_unknowns(given: Any) -> tuple[Unknown, ...]:
    """From a list of `Unknown` or of plain paths."""
    if isinstance(given, (str, Unknown)):
        given = [given]
    found = tuple(
        one if isinstance(one, Unknown) else Unknown(text(one, "a parameter that is looked for"))
        for one in listed(given, "parameters")
    )
    if not found:
        raise InputError("no parameter is looked for: name one at least")
    seen: set[str] = set()
    for one in found:
        for path in (one.path, *one.also):
            if path in seen:
                raise InputError(f"`{path}`: is looked for twice: name it once")
            seen.add(path)
    return found


def expanded(given: Any, machine: Any) -> tuple[Unknown, ...]:
    """`as_unknowns`, where a path to a list of numbers stands for each of its entries."""
    found = []
    for one in as_unknowns(given):
        whole, entry = split_entry(one.path)
        value = None if entry is not None or one.also else machine.get(whole)
        if value is not None and np.ndim(value) == 1:
            found += [dataclasses.replace(one, path=f"{whole}[{k}]") for k in range(np.size(value))]
        else:
            found.append(one)
    return tuple(found)
