"""What journal bearings of pads have in common, fixed or tilting."""

import abc
from collections.abc import Callable, Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import numbers
from ...core.errors import InputError, refuse
from ...core.parameter import known, problems
from ...core.protocol import AbstractAttachment, Motion, Prepared, Tabulated, Vec6
from ...core.quick import lightly_compiled
from .pad_faults import pad_faults
from .pad_heat import warmed
from .pad_point import PadPoint
from .pads import Flow, Pads

# Of the load, what may be missed before an equilibrium counts as not found.
MISSED = 1e-6


class AbstractPadBearing(AbstractAttachment, Prepared, Tabulated):
    """A journal bearing of pads, linear about where the journal runs under a load."""

    diameter: eqx.AbstractVar[Array]
    length: eqx.AbstractVar[Array]
    clearance: eqx.AbstractVar[Array]
    viscosity: eqx.AbstractVar[Array]
    load: eqx.AbstractVar[Array]
    speeds: eqx.AbstractVar[Array]
    pads: eqx.AbstractVar[Array]
    arc: eqx.AbstractVar[Array]
    preload: eqx.AbstractVar[Array]
    offset: eqx.AbstractVar[Array]
    thinning: eqx.AbstractVar[Array | None]
    heat_capacity: eqx.AbstractVar[Array]
    carried: eqx.AbstractVar[Array]
    around: eqx.AbstractVar[int]
    along: eqx.AbstractVar[int]

    @abc.abstractmethod
    def middles(self) -> Float[Array, " p"]:
        """Of the pads' arcs, rad."""

    @abc.abstractmethod
    def found_at(self, load: Array, speed: Array) -> tuple[PadPoint, Array]:
        """Equilibrium, and how much of the load is missed."""

    @abc.abstractmethod
    def tabulated(self) -> tuple[Any, Array]:
        """The support with its coefficients at `speeds`, and how much of the load is missed at each."""

    def faults(self) -> Iterator[str]:
        yield from pad_faults(self)

    def bore(self) -> Pads:
        arc, preload, offset = (
            jnp.broadcast_to(x, self.pads.shape) for x in (self.arc, self.preload, self.offset)
        )
        middle = self.middles()
        return Pads(
            middle,
            middle + (offset - 0.5) * arc,
            arc,
            self.clearance / (1 - preload),
            preload,
            0.5 * self.diameter,
            self.length,
            self.viscosity,
            self.clearance,
        )

    def warm(self, flow_at: Callable[[Pads], Flow]) -> Pads:
        """The bore, with oil as warm as its shear makes it; `flow_at` finds the flow in one."""
        pads, thinning = self.bore(), self.thinning
        if thinning is None:
            return pads

        def heat(pads):
            flow = flow_at(pads)
            return flow.power, flow.leakage

        return warmed(heat, pads, thinning, self.heat_capacity / self.carried)

    def working_point(
        self, speed: Float[Array, ""] | float, load: Float[Array, "2"] | Any = None
    ) -> PadPoint:
        """Equilibrium at a `speed` of the journal (rad/s) under its `load`, or another one, (x, y) N.
        Differentiable.

        Raises `InputError` for parameters that a machine refuses too, where speed or load is not finite or
        zero, and where no equilibrium is found.
        """
        refuse(problems(self, type(self).__name__))
        given = self.load if load is None else jnp.asarray(load, float)
        speed = jnp.asarray(speed, float)
        for name, value, size in (("load", given, 1), ("speed", speed, 0)):
            number = known(value)
            if number is not None and not (
                number.ndim == size and np.isfinite(number).all() and np.any(number != 0)
            ):
                raise InputError(f"{name} must be finite and not zero, but is {number}")
        point, missed = point_of(self, given, speed)
        self._borne(missed, speed)
        return point

    def at_speeds(self, speeds: Any) -> Any:
        """`tabulated`, checked, at its `speeds` or others."""
        refuse(problems(self, type(self).__name__))
        if speeds is not None:
            speeds = numbers("rad/s", least=0.0, fewest=2, rising=True)(speeds, "speeds")
            self = eqx.tree_at(lambda b: b.speeds, self, jnp.asarray(speeds, float))
            refuse(problems(self, type(self).__name__))
        found, missed = _tabulated(self)
        number = known(missed)
        if number is not None:
            worst = int(np.argmax(np.where(np.isnan(number), np.inf, number)))
            self._borne(missed[worst], self.speeds[worst])
        return found

    def _borne(self, missed: Array, speed: Array) -> None:
        number = known(missed)
        if number is not None and not number < MISSED:
            raise InputError(
                f"load must be one that the pads bear, but no equilibrium is found at a speed of "
                f"{float(speed):g} rad/s: a smaller load, a higher speed, or pads where the load points"
            )

    def prepared(self) -> Any:
        return self.tabulated()[0]

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return self.prepared().forces(t, motions, state)

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return jnp.abs(motions[-1][1][5]), self.speeds, "rad/s"


@lightly_compiled
def point_of(bearing: AbstractPadBearing, load: Array, speed: Array) -> tuple[PadPoint, Array]:
    """NaN where no equilibrium is found."""
    point, missed = bearing.found_at(load, speed)
    met = missed < MISSED
    return jax.tree.map(lambda x: jnp.where(met, x, jnp.nan), point), missed


@lightly_compiled
def _tabulated(bearing: AbstractPadBearing) -> tuple[Any, Array]:
    return bearing.tabulated()
