"""Measures of the machine itself: of its linear model, and of what it weighs."""

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import InputError
from ..linear.cluster import decay_rate, pole_cluster
from ..linear.linearise import linearize
from ..linear.norms import h2_norm, response_peaks
from ..linear.peak import unbalance_peak
from ..linear.torsion import torsional
from ..machine.machine import Machine
from ..parameter import parameter, problems
from .criterion import Criterion, Judging
from .experiment import AsBuilt
from .mass import total_mass


class AbstractMachineMeasure(eqx.Module, Judging):
    """Judges a machine that need not run; minimised or bounded as it is: `TotalMass() <= 12.0`. One of your
    own needs `unit` and `__call__`, which may return several numbers: the largest counts."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI unit; empty where it is not known."""

    @abc.abstractmethod
    def __call__(self, machine: Machine) -> Array:
        """The number or numbers."""

    def __check_init__(self):
        found = list(problems(self, type(self).__name__))
        if found:
            raise InputError(*found)

    def criterion(self) -> Criterion:
        return AsBuilt().measure(self)


class TotalMass(AbstractMachineMeasure):
    """Mass of all that moves with the line, kg: see `total_mass`."""

    unit: ClassVar[str] = "kg"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return total_mass(machine)


class ResponsePeaks(AbstractMachineMeasure):
    """The `count` highest peaks of |output per input| between `start` and `stop`, rad/s: see
    `response_peaks`. Minimised, their largest is: the H-infinity norm, where the range holds it."""

    input: str = eqx.field(static=True)
    output: str = eqx.field(static=True)
    start: float = eqx.field(static=True)
    stop: float = eqx.field(static=True)
    count: int = eqx.field(static=True, default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = eqx.field(static=True, default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = ""

    def __call__(self, machine: Machine) -> Float[Array, " count"]:
        peaks = response_peaks(
            machine, self.input, self.output, self.start, self.stop, self.count,
            speed=self.speed, at=self.at, torsion=self.torsion,
        )  # fmt: skip
        return peaks.magnitudes


class H2Norm(AbstractMachineMeasure):
    """RMS of `output` under white noise at `input`: see `h2_norm`."""

    input: str = eqx.field(static=True)
    output: str = eqx.field(static=True)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = eqx.field(static=True, default="equilibrium")
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
    at: str = eqx.field(static=True, default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = "1/s"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return decay_rate(_model(machine, self.speed, self.at, self.torsion))


class PoleMean(AbstractMachineMeasure):
    """Real part of the mean of the `count` poles nearest to `near` (real, imaginary part, 1/s): smooth where
    they coalesce. See `pole_cluster`."""

    near: Float[Array, "2"] = parameter("1/s", shapes=((2,),))
    count: int = eqx.field(static=True, default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = eqx.field(static=True, default="equilibrium")
    torsion: bool = eqx.field(static=True, default=False)
    unit: ClassVar[str] = "1/s"

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return _cluster(self, machine).mean.real


class PoleSpread(AbstractMachineMeasure):
    """Real and imaginary part of the mean squared distance of those poles from their mean, 1/s²: both zero
    where they coalesce, `PoleSpread(...).equal_to(0.0)`."""

    near: Float[Array, "2"] = parameter("1/s", shapes=((2,),))
    count: int = eqx.field(static=True, default=2)
    speed: Float[Array, ""] = parameter("rad/s", default=0.0)
    at: str = eqx.field(static=True, default="equilibrium")
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

    output: str = eqx.field(static=True)
    start: float = eqx.field(static=True)
    stop: float = eqx.field(static=True)
    at: str = eqx.field(static=True, default="equilibrium")
    unit: ClassVar[str] = ""

    def __call__(self, machine: Machine) -> Float[Array, ""]:
        return unbalance_peak(machine, self.output, self.start, self.stop, at=self.at).amplitude
