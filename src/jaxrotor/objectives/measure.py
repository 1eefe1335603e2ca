"""Measures: one number each, of a run; and the stretch of time over which they look at it."""

import abc
from collections.abc import Iterator
from typing import NoReturn

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..core.errors import InputError, refuse
from ..core.parameter import known, parameter, problems
from ..core.part import Part
from ..sensors.sensor import AbstractSensor
from ..simulation.response import Response


class Seen(eqx.Module):
    """What sensors saw of a run that was not kept: it stands in for the `Response`. `t`: (nt,), s."""

    t: Float[Array, " nt"]
    sensors: tuple[AbstractSensor, ...]
    signals: tuple[Float[Array, " nt"], ...]


def see(response: Response | Seen, sensor: AbstractSensor) -> Float[Array, " nt"]:
    """The signal of a sensor, of a run or of what was kept of it."""
    if not isinstance(response, Seen):
        return sensor.signal(response)
    return next(s for own, s in zip(response.sensors, response.signals) if alike(own, sensor))


def alike(a: AbstractSensor, b: AbstractSensor) -> bool:
    """The same kind with the same words, and the same numbers as objects: they may be traced."""
    same = jax.tree.structure(a) == jax.tree.structure(b)
    return same and all(x is y for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b)))


class AbstractMeasure(Part):
    """One number that judges a run. One of your own needs `unit` and `__call__`.

    A pure function of the response: it may stand inside `jit`, `vmap` and `grad` (both modes). Numbers out
    of bounds are refused where it is made.
    """

    def __check_init__(self) -> None:
        refuse(problems(self, type(self).__name__))

    @abc.abstractmethod
    def __call__(self, response: Response) -> Float[Array, ""]:
        """The number, in `unit`."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI unit as pint reads it; empty for a pure number."""

    def __le__(self, limit: float) -> NoReturn:
        self._of_no_run("<=", limit)

    def __ge__(self, limit: float) -> NoReturn:
        self._of_no_run(">=", limit)

    def _of_no_run(self, sense: str, limit: float) -> NoReturn:
        kind = type(self).__name__
        raise InputError(
            f"a {kind} judges a run, and is compared where it is said which one: "
            f"SimulatedRun(...).measure({kind}(...)) {sense} {limit}"
        )


class AbstractSignalMeasure(AbstractMeasure):
    """Judges what one sensor sees between `start` and `stop` (s), both included; left out, they are the
    ends of the run. They are numbers, not shapes: another window needs no new compilation.

    A window that holds no sample is refused; inside `jit`, where it cannot be, the measure is NaN.
    """

    sensor: AbstractSensor
    start: Float[Array, ""] | None = parameter(
        "s", nonnegative=True, optional=True, default=None, kw_only=True
    )
    stop: Float[Array, ""] | None = parameter(
        "s", positive=True, optional=True, default=None, kw_only=True
    )

    @abc.abstractmethod
    def sensors(self) -> tuple[AbstractSensor, ...]:
        """All that it looks at, through `see`: a sweep keeps nothing else of a run."""


def window_faults(measure: AbstractSignalMeasure) -> Iterator[str]:
    """For `faults`, where the numbers are known."""
    if measure.start is not None and measure.stop is not None and measure.start >= measure.stop:
        yield f"start must lie before stop, but they are {measure.start:g} and {measure.stop:g} s"


def span(measure: AbstractSignalMeasure, response: Response) -> tuple[Array, Array]:
    """Start and stop of the window inside the run, s; NaN where nothing is left of it."""
    first, last = response.t[0], response.t[-1]
    start = first if measure.start is None else jnp.clip(measure.start, first, last)
    stop = last if measure.stop is None else jnp.clip(measure.stop, first, last)
    _refuse_empty(measure, response, start < stop)
    start = jnp.where(start < stop, start, jnp.nan)
    return start, stop


def within(measure: AbstractSignalMeasure, response: Response) -> Bool[Array, " nt"]:
    """Which samples lie in the window."""
    t = response.t
    slack = 1e-6 * (t[1] - t[0])  # a window meant to end on a sample includes it
    inside = jnp.ones(t.shape, bool)
    if measure.start is not None:
        inside &= t >= measure.start - slack
    if measure.stop is not None:
        inside &= t <= measure.stop + slack
    _refuse_empty(measure, response, jnp.any(inside))
    return inside


def _refuse_empty(measure: AbstractSignalMeasure, response: Response, full: Array) -> None:
    found, t = known(full), known(response.t)
    if found is None or t is None or found:
        return
    start, stop = (None if x is None else known(x) for x in (measure.start, measure.stop))
    since = "" if start is None else f" from {start:g} s"
    until = "" if stop is None else f" until {stop:g} s"
    raise InputError(
        f"`{type(measure).__name__}`: its window{since}{until} holds nothing of the run, which has samples "
        f"from {t[0]:g} to {t[-1]:g} s: move the window, or run longer"
    )


def or_nan(seen: Float[Array, " nt"], inside: Bool[Array, " nt"], value: Array) -> Array:
    """The value, or NaN where nothing is inside, or something that is no number: a run that failed must not
    pass for a quiet one."""
    sound = jnp.any(inside) & jnp.all(jnp.isfinite(seen) | ~inside)
    return jnp.where(sound, value, jnp.nan)
