"""The grid of a run with sampling controllers: samples of the result and ticks of all clocks."""

from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.errors import InputError
from ..machine.machine import Machine
from ..machine.sampling import clocks_of, machine_clocks, ticked
from ..machine.system import System

# Intervals of the grid in a sample interval, at most.
_FINEST = 64


@dataclass(frozen=True)
class Grid:
    """`refine` intervals in a sample interval; of each clock (period, first instant) the number of
    intervals between its ticks and before its first."""

    refine: int
    ticks: tuple[tuple[tuple[float, float], tuple[int, int]], ...]


def grid_of(machine: Machine, sample_rate: float) -> Grid | None:
    """`None` for a machine without clocks. Raises `InputError` where the clocks and the samples have no
    common grid."""
    clocks = machine_clocks(machine)
    if not clocks:
        return None
    ratios = {}
    for name, *clock in clocks:
        for what, value in zip(("period", "delay"), clock):
            ratio = Fraction(value * sample_rate).limit_denominator(_FINEST)
            if abs(float(ratio) - value * sample_rate) > 1e-9 * max(1.0, value * sample_rate):
                raise InputError(
                    f"`{name}`: {what} must be a simple fraction of the sample interval, "
                    f"{1 / sample_rate:g} s, but is {value:g} s, {value * sample_rate:g} of it: choose "
                    "another sample_rate"
                )
            ratios[value] = ratio
    refine = lcm(*(ratio.denominator for ratio in ratios.values()))
    if refine > _FINEST:
        raise InputError(
            f"the clocks of {', '.join(f'`{n}`' for n in dict.fromkeys(c[0] for c in clocks))} and the "
            f"sample interval, {1 / sample_rate:g} s, have no common grid of {_FINEST} steps: choose "
            "periods, delays and sample_rate as simple fractions of each other"
        )
    ticks = {
        (period, first): (int(ratios[period] * refine), int(ratios[first] * refine))
        for _, period, first in clocks
    }
    return Grid(refine, tuple(ticks.items()))


class Ticking:
    """What `march` asks at each of its knots."""

    def __init__(self, grid: Grid, system: System, samples: int, d: int):
        table = dict(grid.ticks)
        at = np.arange((samples - 1) * grid.refine + 1)
        due = []
        for clock in clocks_of(system):
            every, first = table[clock.period, clock.first]
            due.append((at >= first) & ((at - first) % every == 0))
        self.refine, self.system, self.d = grid.refine, system, d
        self.due = np.stack(due, axis=1)  # (knots of the grid, clocks)

    def fine(self, samples: Float[Array, " nt"]) -> Float[Array, " n"]:
        """The instants of the grid."""
        interval = (samples[1] - samples[0]) / self.refine
        return samples[0] + interval * jnp.arange(len(self.due))

    def tick(self, t: Any, y: Array, due: Any) -> Array:
        """Entries beyond the machine's own states (accounts of energy) stay as they are."""
        d = self.d
        return jnp.concatenate([ticked(t, y[:d], self.system, due), y[d:]])
