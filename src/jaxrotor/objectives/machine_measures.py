"""Measures of the machine itself: of its linear model, and of what it weighs."""

import abc
import math
from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import choice, number, text, whole
from ..core.errors import refuse
from ..core.kinematics import COORDINATES
from ..core.parameter import parameter, problems
from ..core.part import Part, option
from ..linear.cluster import decay_rate, pole_cluster
from ..linear.linearise import linearize
from ..linear.norms import h2_norm, response_peaks
from ..linear.observe import outputs_of
from ..linear.peak import unbalance_peak
from ..linear.torsion import torsional
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from .criterion import Criterion, Judging
from .mass import total_mass

# How study files give what is no parameter: in which unit, and in which others, with their size in it.
_SPEED: dict[str, Any] = {"quantity": "rad/s"}
_FREQUENCY = {**_SPEED, "also": {"Hz": 2 * math.pi}}


class AbstractMachineMeasure(Part, Judging):
    """Judges a machine that need not run; minimised or bounded as it is: `TotalMass() <= 12.0`. One of your
    own needs `unit` and `__call__`, which may return several numbers: the largest counts."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI unit; empty where it is not known."""

    @abc.abstractmethod
    def __call__(self, machine: Machine) -> Array:
        """The number or numbers."""

    def __check_init__(self) -> None:
        refuse(problems(self, type(self).__name__))

    def criterion(self) -> Criterion:
        return Criterion(((1.0, None, self, "worst"),))


class TotalMass(AbstractMachineMeasure):
    """Mass of all that moves with the line, kg: see `total_mass`."""

    unit: ClassVar[str] = "kg"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return total_mass(machine)


class ResponsePeaks(AbstractMachineMeasure):
    """The `count` highest peaks of |output per input| between `start` and `stop`, rad/s: see
    `response_peaks`. Minimised, their largest is: the H-infinity norm, where the range holds it."""

    input: str = option(text)
    output: str = option(text)
    start: float = option(number("rad/s", least=0.0), metadata=_FREQUENCY)
    stop: float = option(number("rad/s", least=0.0), metadata=_FREQUENCY)
    count: int = option(whole(1, 1000), default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = ""

    def faults(self) -> Iterator[str]:
        yield from _range_faults(self)

    def __call__(self, machine: Machine) -> Float[Array, " count"]:
        peaks = response_peaks(
            machine, self.input, self.output, self.start, self.stop, self.count,
            speed=self.speed, at=self.at, torsion=self.torsion,
        )  # fmt: skip
        return peaks.magnitudes


class H2Norm(AbstractMachineMeasure):
    """RMS of `output` under white noise at `input`: see `h2_norm`."""

    input: str = option(text)
    output: str = option(text)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = ""

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return h2_norm(
            machine, self.input, self.output, speed=self.speed, at=self.at, torsion=self.torsion
        )


def _model(machine: Machine, speed: Any, at: Any, torsion: bool):
    model = linearize(machine, speed, at)
    return torsional(model) if torsion else model


class DecayRate(AbstractMachineMeasure):
    """How fast the slowest free motion dies out, 1/s (maximise: minimise `-1 * DecayRate()`). Where poles
    coalesce, as at the greatest stability, it has no slope: `PoleMean` and `PoleSpread` do."""

    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = "1/s"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return decay_rate(_model(machine, self.speed, self.at, self.torsion))


class PoleMean(AbstractMachineMeasure):
    """Real part of the mean of the `count` poles nearest to `near` (real, imaginary part, 1/s): smooth where
    they coalesce. See `pole_cluster`."""

    near: Float[Array, "2"] = parameter("1/s", shapes=((2,),))
    count: int = option(whole(1, 1000), default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = "1/s"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return _cluster(self, machine).mean.real


class PoleSpread(AbstractMachineMeasure):
    """Real and imaginary part of the mean squared distance of those poles from their mean, 1/s²: both zero
    where they coalesce, `PoleSpread(...).equal_to(0.0)`."""

    near: Float[Array, "2"] = parameter("1/s", shapes=((2,),))
    count: int = option(whole(1, 1000), default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = "1/s^2"

    def __call__(self, machine: Machine) -> Float[Array, "2"]:
        spread = _cluster(self, machine).spread
        return jnp.stack([spread.real, spread.imag])


def _cluster(measure: PoleMean | PoleSpread, machine: Machine):
    model = _model(machine, measure.speed, measure.at, measure.torsion)
    near = measure.near[0] + 1j * measure.near[1]
    return pole_cluster(model, near, measure.count)


class UnbalancePeak(AbstractMachineMeasure):
    """The highest response of `output` to the machine's unbalance between the speeds `start` and `stop`,
    rad/s: see `unbalance_peak`."""

    output: str = option(text)
    start: float = option(number("rad/s"), metadata=_SPEED)
    stop: float = option(number("rad/s"), metadata=_SPEED)
    at: str = option(choice("equilibrium", "undeformed"), default="equilibrium")
    unit: ClassVar[str] = ""

    def faults(self) -> Iterator[str]:
        yield from _range_faults(self)

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return unbalance_peak(machine, self.output, self.start, self.stop, at=self.at).amplitude


def _range_faults(measure: Any):
    if not measure.start < measure.stop:
        yield f"start and stop must rise, but are {measure.start:g} and {measure.stop:g} rad/s"


def unit_on(measure: Any, machine: Machine) -> str:
    """Unit of a measure, found on the machine where what it looks at is told by name alone; empty for a pure
    number, and where it is not known. Raises `InputError` for names that are none."""
    if isinstance(measure, UnbalancePeak):
        return _unit_of(measure.output, machine)
    if not isinstance(measure, (ResponsePeaks, H2Norm)):
        return getattr(measure, "unit", "")
    out = _unit_of(measure.output, machine)
    force = "N" if measure.input.rpartition(".")[2] in ("x", "y", "z") else "N*m"
    top, below = (f"({unit})" if "*" in unit else unit for unit in (out, force))
    ratio = "" if out == force else f"{top}/{below}"
    return f"{ratio or '1'}/s**0.5" if isinstance(measure, H2Norm) else ratio


def _unit_of(output: str, machine: Machine) -> str:
    places = tuple((s, c) for s in structure_of(machine).wiring.stations for c in COORDINATES)
    return outputs_of(machine, places, (output,))[0].unit
