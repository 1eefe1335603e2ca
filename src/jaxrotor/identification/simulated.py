"""What the channels would have recorded, and its slopes: the costly part, compiled once for all stages."""

import abc
import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.quick import lightly_compiled, traced
from ..search.instrumented import Instrumented
from ..search.space import Space
from ..simulation.response import Response
from ..simulation.simulate import simulate
from ..simulation.simulation import Simulation


class AbstractRun(eqx.Module):
    """Something measured, ready to be simulated: `channels` are asked at `times` (s, or whatever they are
    recorded over)."""

    times: eqx.AbstractVar[tuple[Array, ...]]
    channels: eqx.AbstractVar[tuple[str, ...]]
    # Whether batches go one after the other: calls of LAPACK side by side can deadlock (docs/solving.md).
    one_by_one: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def records(self, bench: Instrumented) -> tuple[Array, ...]:
        """Of each channel, without noise: real, or complex where vectors are recorded."""


class Run(AbstractRun):
    """One measured run through time."""

    times: tuple[Array, ...]
    conditions: dict[str, Any]
    simulation: Simulation
    channels: tuple[str, ...] = eqx.field(static=True)
    one_by_one: ClassVar[bool] = False

    @classmethod
    def of(
        cls, times: Mapping[str, Any], conditions: Mapping[str, Any], simulation: Simulation
    ) -> "Run":
        """With its numbers as leaves: other ones do not recompile. `times`: by channel."""
        return cls(
            times=tuple(jnp.asarray(t) for t in times.values()),
            conditions={path: _as_array(value) for path, value in conditions.items()},
            simulation=dataclasses.replace(simulation, speed=_as_array(simulation.speed)),
            channels=tuple(times),
        )

    def response(self, bench: Instrumented) -> Response:
        machine = bench.machine.set(self.conditions) if self.conditions else bench.machine
        return simulate(machine, self.simulation, progress=False)

    def records(self, bench: Instrumented) -> tuple[Array, ...]:
        response = self.response(bench)
        return tuple(
            bench.channels[name].measure(response, t) for name, t in zip(self.channels, self.times)
        )


class Simulated(eqx.Module):
    """Every run at any place of the search."""

    bench: Instrumented
    runs: tuple[AbstractRun, ...]
    space: Space

    def records(self, u: Float[Array, " n"]) -> tuple[Float[Array, " nt"], ...]:
        """Without noise, one for each channel of each run in turn; of vectors the real parts, then the
        imaginary ones."""
        bench = self.space.placed(self.bench, u)
        return tuple(as_real(record) for run in self.runs for record in run.records(bench))


# So often the program that gives slopes too, where it is compiled, serves for records alone: a program of
# their own takes longer to compile than that. Later it pays.
_WITHOUT = 8
_used: dict[Any, int] = {}  # how often it has, by the structure of what is simulated


def _structure(simulated: Simulated) -> Any:
    dynamic, static = eqx.partition(simulated, eqx.is_array)
    leaves, tree = jax.tree.flatten(static)
    return tree, tuple(leaves), tuple(x.shape for x in jax.tree.leaves(dynamic))


def slopes_come_along(simulated: Simulated) -> bool:
    """Whether records alone are taken from the program that gives slopes too."""
    return not traced(simulated) and _used.get(_structure(simulated), _WITHOUT) < _WITHOUT


def slopes_were_spare(simulated: Simulated) -> None:
    """Slopes came along, and nobody needs them."""
    _used[_structure(simulated)] += 1


class _Place(NamedTuple):
    """What was simulated there; `slopes` where they were asked for."""

    simulated: Simulated
    u: Any  # (n,)
    records: tuple[Array, ...]
    slopes: tuple[Array, ...] | None

    def serves(self, simulated: Simulated, u: np.ndarray) -> bool:
        (mine, own), (theirs, asked) = (jax.tree.flatten(s) for s in (self.simulated, simulated))
        same = own == asked and all(a is b for a, b in zip(mine, theirs, strict=True))
        return same and np.array_equal(self.u, u)


# The latest places of a search: whoever weighs, judges and tells what it found asks for them once more.
_places: ContextVar[list[_Place] | None] = ContextVar("places", default=None)
_REMEMBERED = 32


@contextlib.contextmanager
def places_remembered() -> Iterator[None]:
    """In which no place of the latest is simulated twice. Slopes are large: of two places alone."""
    before = _places.set([])
    try:
        yield
    finally:
        _places.reset(before)


def _known(simulated: Simulated, u: Array, slopes: bool) -> _Place | None:
    latest = _places.get()
    if not latest or traced(simulated, u):
        return None
    at = np.asarray(u)
    fit = (p for p in reversed(latest) if p.slopes is not None or not slopes)
    return next((p for p in fit if p.serves(simulated, at)), None)


def _remember(place: _Place) -> None:
    latest = _places.get()
    if latest is None or traced(place):
        return
    if place.slopes is not None:
        last = max((i for i, p in enumerate(latest) if p.slopes is not None), default=-1)
        latest[:] = [p if i == last else p._replace(slopes=None) for i, p in enumerate(latest)]
    latest[:] = [*latest[1 - _REMEMBERED :], place]


def records(simulated: Simulated, u: Float[Array, " n"]) -> tuple[Array, ...]:
    """`simulated.records`, compiled."""
    known = _known(simulated, u, slopes=False)
    if known is not None:
        return known.records
    if not traced(u) and slopes_come_along(simulated):
        slopes_were_spare(simulated)
        return tuple(x[0] for x in records_and_slopes(simulated, u[None])[0])
    found = _records(simulated, u)
    _remember(_Place(simulated, u, found, None))
    return found


def records_and_slopes(
    simulated: Simulated, u: Float[Array, "b n"]
) -> tuple[tuple[Float[Array, "b nt"], ...], tuple[Float[Array, "b nt n"], ...]]:
    """At a batch of places."""
    if len(u) != 1 or traced(simulated, u):
        return _records_and_slopes(simulated, u)
    _used.setdefault(_structure(simulated), 0)
    known = _known(simulated, u[0], slopes=True)
    if known is None:
        found, slopes = (tuple(x[0] for x in own) for own in _records_and_slopes(simulated, u))
        known = _Place(simulated, u[0], found, slopes)
        _remember(known)
    return tuple(x[None] for x in known.records), tuple(x[None] for x in known.slopes or ())


@lightly_compiled
def _records(simulated: Simulated, u: Float[Array, " n"]) -> tuple[Array, ...]:
    return simulated.records(u)


@lightly_compiled
def _records_and_slopes(
    simulated: Simulated, u: Float[Array, "b n"]
) -> tuple[tuple[Float[Array, "b nt"], ...], tuple[Float[Array, "b nt n"], ...]]:
    """The slopes by forward mode, for they are few and the steps are many."""

    def twice(u):
        found = simulated.records(u)
        return found, found

    def both(u):
        slopes, found = jax.jacfwd(twice, has_aux=True)(u)
        return found, slopes

    if u.shape[0] == 1:  # a batch of one costs more than none
        return jax.tree.map(lambda x: x[None], both(u[0]))
    if any(run.one_by_one for run in simulated.runs):
        return jax.lax.map(both, u)
    return jax.vmap(both)(u)


def as_real(x: Any) -> Any:
    """A row of real numbers: of complex ones the real parts, then the imaginary ones."""
    xp = jnp if isinstance(x, jax.Array) else np
    return xp.concatenate([x.real, x.imag]) if xp.iscomplexobj(x) else x


def as_vectors(x: Any) -> np.ndarray:
    """Complex numbers from what `as_real` made of them."""
    real, imaginary = np.split(np.asarray(x), 2)
    return real + 1j * imaginary


def _as_array(x: Any) -> Any:
    return None if x is None else jnp.asarray(x, float)
