"""The residuals: what was simulated less what was measured, in standard deviations."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..core.errors import InputError
from ..core.quick import lightly_compiled
from ..core.units import factor, known_unit
from ..machine.wiring import unknown
from ..search.instrumented import Instrumented
from ..search.space import Space
from ..sensors.tracking_filter import TrackingFilter
from ..simulation.response import StationResponse
from ..simulation.simulate import for_slopes
from .domain import AbstractDomain, Angles, Compared, Frequencies, Time
from .loss import loss_number, shaped
from .measured_response import MeasuredResponse, filter_of
from .simulated import AbstractRun, Run, Simulated, as_real
from .trials import Trial


class Signal(eqx.Module):
    """One channel of one run: measured `values` (nt,) where `valid` is 1, and what is compared of them. Of
    `vectors` the real parts, then the imaginary ones."""

    values: Float[Array, " nt"]
    valid: Float[Array, " nt"]
    std: Float[Array, ""]
    compared: Compared
    channel: str = eqx.field(static=True)
    run: str = eqx.field(static=True)
    vectors: bool = eqx.field(static=True, default=False)

    def residual(self, record: Float[Array, " nt"]) -> Float[Array, " k"]:
        there = self.valid > 0
        model = self.compared(jnp.where(there, record, 0.0))
        return (model - self.compared(jnp.where(there, self.values, 0.0))) / (
            self.std * self.compared.spread
        )

    @property
    def count(self) -> int:
        """Values that are compared."""
        if self.compared.matrix is None:
            return int(np.sum(np.asarray(self.valid)))
        return self.compared.spread.shape[0]


class Problem(eqx.Module):
    """Runs and what they should meet. The arrays are leaves: other data do not recompile. `loss`: one of
    `LOSSES`, by its number."""

    simulated: Simulated
    signals: tuple[Signal, ...]
    loss: Int[Array, ""]

    @property
    def space(self) -> Space:
        return self.simulated.space

    @property
    def count(self) -> int:
        """Values that are compared, priors among them."""
        return sum(s.count for s in self.signals) + len(self.space.with_prior)

    def residual(self, u: Float[Array, " n"]) -> Float[Array, " m"]:
        """By a simulation of its own."""
        return self.residual_of(u, self.simulated.records(u))

    def residual_of(self, u: Float[Array, " n"], records: tuple[Array, ...]) -> Float[Array, " m"]:
        """From what was simulated at `u`."""
        rs = [
            shaped(self.loss, signal.residual(record))[0]
            for signal, record in zip(self.signals, records)
        ]
        return jnp.concatenate([*rs, *self.space.priors(u)])


@lightly_compiled
def residual_and_slopes(
    problem: Problem, u: Float[Array, " n"], found: tuple[Array, ...], slopes: tuple[Array, ...]
) -> tuple[Float[Array, " m"], Float[Array, "m n"]]:
    """From the simulated records and their slopes at `u`."""
    rs, Js = [], []
    for signal, record, slope in zip(problem.signals, found, slopes):
        push = lambda d, s=signal, x=record: jax.jvp(s.residual, (x,), (d,))[1]  # noqa: E731
        r, slant = shaped(problem.loss, signal.residual(record))
        rs.append(r)
        Js.append(slant[:, None] * jax.vmap(push, in_axes=1, out_axes=1)(slope))
    rs += problem.space.priors(u)
    Js += jax.jacfwd(problem.space.priors)(u)
    return jnp.concatenate(rs), jnp.concatenate(Js)


def pose(
    bench: Instrumented,
    space: Space,
    trials: Sequence[Trial],
    domain: AbstractDomain,
    shaft: str | None,
    loss: str = "squares",
) -> Problem:
    """`shaft`: the station whose simulated angle, at the start, says where the shaft stands."""
    runs, signals = [], []
    start = space.placed(bench, jnp.zeros(len(space)))
    for trial in trials:
        run = trial.posed()
        signals += _signals(bench, trial, domain, _angles(run, start, shaft))
        runs.append(run)
    problem = Problem(Simulated(bench, tuple(runs), space), tuple(signals), loss_number(loss))
    _refuse_too_few(problem.count, space)
    return problem


def check_data(
    bench: Instrumented,
    space: Space,
    trials: Sequence[Trial],
    domains: Sequence[AbstractDomain],
) -> None:
    """What `pose` would refuse, as far as it can be told before anything runs: all but how the shaft turns.
    Raises `InputError`."""
    for domain in domains:
        # others may ask for the shaft's angle, which is simulated
        known = domain if isinstance(domain, (Time, Frequencies)) else Time()
        signals = [s for trial in trials for s in _signals(bench, trial, known, _unknown_angles)]
        _refuse_too_few(sum(s.count for s in signals) + len(space.with_prior), space)


def _unknown_angles(times: Any) -> np.ndarray:
    raise AssertionError("nothing runs yet")


def _refuse_too_few(count: int, space: Space) -> None:
    if count <= len(space):
        raise InputError(
            f"{count} measured values cannot tell {len(space)} parameters: record more"
        )


def _signals(
    bench: Instrumented, trial: Trial, domain: AbstractDomain, angles: Angles
) -> list[Signal]:
    """What a run measured, in the units of the channels, and how it is compared."""
    found = []
    for name, one in trial.series.items():
        place = f"`{trial.name}`: {name}"
        if name not in bench.channels:
            raise InputError(f"{place}: {unknown('channel', name, list(bench.channels))}")
        channel = bench.channels[name]
        if isinstance(trial, MeasuredResponse):
            filter_of(channel, place)
        one = _converted(one, channel.recorded_in, place)
        vectors = bool(np.iscomplexobj(one.values))
        if vectors != isinstance(channel, TrackingFilter):
            words = "vectors: record them by a TrackingFilter" if vectors else "no vectors"
            raise InputError(
                f"{place}: the record holds {words}, but the channel is a {type(channel).__name__}"
            )
        # vectors turn with the shaft already
        compared = (
            Time().compare(one, angles, place) if vectors else domain.compare(one, angles, place)
        )
        valid, values = one.valid, as_real(np.where(one.valid, one.values, 0.0))
        if vectors:
            valid = np.tile(valid, 2)
        known = values[valid]
        std = channel.noise.std if channel.noise is not None else None
        if std is None or not float(std) > 0:
            std = jnp.asarray(np.std(known) or 1.0)
        found.append(
            Signal(
                jnp.asarray(values),
                jnp.asarray(valid, float),
                std,
                compared,
                name,
                trial.name,
                vectors,
            )
        )
    return found


def _converted(series: Any, unit: str, place: str) -> Any:
    """In the unit of its channel."""
    if not series.unit or series.unit == unit:
        return series
    size = factor(series.unit, unit) if known_unit(series.unit) and known_unit(unit) else None
    if size is None:
        raise InputError(
            f"{place}: is in {series.unit}, but the channel records {unit}: give the channel that unit and "
            "its sensitivity"
        )
    return series.scaled(size, unit, place)


def _angles(run: AbstractRun, bench: Instrumented, shaft: str | None) -> Angles:
    """The shaft's angle at any times, simulated once somebody asks."""
    found: list[np.ndarray] = []

    def at(times):
        if not found:
            assert isinstance(run, Run)  # steady vectors are compared as they are
            response = run.response(bench)
            part = response[bench.machine.wiring.stations[0] if shaft is None else shaft]
            if not isinstance(part, StationResponse):
                raise InputError(f"shaft: `{shaft}` is no station")
            found.extend([np.asarray(response.t), np.asarray(part.phi)])
        return np.interp(times, found[0], found[1])

    return at


def in_reverse(problem: Problem) -> Problem:
    """The same for slopes by reverse mode."""

    runs = tuple(
        dataclasses.replace(run, simulation=for_slopes(run.simulation, reverse=True))
        if isinstance(run, Run)
        else run
        for run in problem.simulated.runs
    )
    return dataclasses.replace(problem, simulated=dataclasses.replace(problem.simulated, runs=runs))


def weighed(problem: Problem, stds: Sequence[Any]) -> Problem:
    """With other standard deviations, one for each signal in turn."""
    return eqx.tree_at(
        lambda p: [s.std for s in p.signals], problem, [jnp.asarray(s, float) for s in stds]
    )


def with_loss(problem: Problem, loss: str) -> Problem:
    return dataclasses.replace(problem, loss=loss_number(loss))


def with_data(problem: Problem, data: tuple[Array, ...] | None) -> Problem:
    """The same runs with other measured values, one array for each signal."""
    if data is None:
        return problem
    return eqx.tree_at(lambda p: [s.values for s in p.signals], problem, list(data))
