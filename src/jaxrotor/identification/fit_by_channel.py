"""Measured beside simulated, channel by channel."""

import dataclasses
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np

from ..core.result_text import shows
from .loss import LOSSES
from .measured_response import SteadyRun
from .problem import Problem
from .simulated import as_vectors, records
from .uncertainty import too_large, whiteness

# What a robust loss sets aside, in standard deviations, does not count against the rest.
_ASIDE = 4.0


@shows(t="s", measured="@unit", simulated="@unit", std="@unit")
@dataclasses.dataclass(frozen=True)
class ChannelFit:
    """One channel of one run: `measured` and `simulated` at `t` (s, or speeds in rad/s where `over` says
    so), in `unit`, complex where vectors were recorded. `std`: of its noise, of a vector's real and imaginary
    part. `white`: probability that noise is as correlated as its residual; `sized`: that it is as large,
    where the noise was given."""

    run: str
    channel: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    std: float
    white: float | None
    sized: float | None
    over: Literal["time", "speed"] = "time"

    @property
    def residual(self) -> np.ndarray:
        """Measured less simulated, NaN where nothing was measured."""
        return self.measured - self.simulated


def noise_given(problem: Problem) -> list[bool]:
    """Of each signal: whether the size of its noise was given."""
    channels = problem.simulated.bench.channels
    noise = [channels[s.channel].noise for s in problem.signals]
    return [n is not None and float(n.std) > 0 for n in noise]


def meet(problem: Problem, u: Any, scale: float, known: bool = False) -> tuple[ChannelFit, ...]:
    """`scale`: of the standard deviations of signals whose noise was not given (`known`: all were)."""
    simulated = problem.simulated
    robust = LOSSES[int(problem.loss)] != "squares"
    found = []
    times = [(run, t) for run in simulated.runs for t in run.times]
    for signal, (run, t), record, given in zip(
        problem.signals, times, records(simulated, jnp.asarray(u, float)), noise_given(problem)
    ):
        steady = isinstance(run, SteadyRun)  # in any order: neighbours have nothing in common
        size = 1.0 if given or known else scale
        valid = np.asarray(signal.valid) > 0
        r = np.asarray(signal.residual(record)) / size
        whole = signal.compared.matrix is None
        tested = valid & (np.abs(r) < _ASIDE) if whole and robust else valid
        measured = np.where(valid, np.asarray(signal.values), np.nan)
        shown = as_vectors if signal.vectors else np.asarray
        found.append(
            ChannelFit(
                run=signal.run,
                channel=signal.channel,
                unit=simulated.bench.channels[signal.channel].recorded_in,
                t=np.asarray(t),
                measured=shown(measured),
                simulated=shown(record),
                std=float(signal.std) * size,
                white=whiteness(r, tested) if whole and not steady else None,
                sized=too_large(r[tested], int(tested.sum())) if given and whole else None,
                over="speed" if steady else "time",
            )
        )
    return tuple(found)
