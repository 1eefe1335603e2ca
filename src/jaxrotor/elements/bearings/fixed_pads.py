"""Journal bearings of fixed pads: grooved, elliptical, of three and four lobes, offset halves."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import numbers
from ...core.errors import InputError, refuse
from ...core.parameter import known, parameter, problems
from ...core.part import option
from ...core.protocol import AbstractAttachment, Motion, Prepared, Tabulated, Vec6
from ...core.quick import lightly_compiled
from .pad_faults import even, pad_faults
from .pad_point import PadPoint, pad_point
from .pads import Pads, balanced, looked_at
from .support import SpeedDependentSupport

_HALVES = (-1.5707963267948966, 1.5707963267948966)
_ARC = 2.792526803190927  # 160 degrees


class FixedPadBearing(AbstractAttachment, Prepared, Tabulated):
    """A journal bearing of fixed pads: with axial grooves, elliptical (lemon), of three or four lobes, with
    offset halves. Reynolds' equation on each pad, of finite length; linear about the equilibrium under a load.

    Attached to a station, it acts between that and the ground, at the speed of the station; attached to
    `(station, rotor)` by the speed of the second, on which it does not act. The force is `-K d - C d'`, d
    measured from where the journal runs at that speed: weight and other steady loads that `load` contains
    are not to act on the rotor once more. K and C are found at `speeds` once a run, exact each, with a
    monotone cubic between them, constant outside (a run that goes there says so).

    - `diameter`, `length`: m. `clearance`: radial, of the largest circle that the bearing holds, m; a pad's
      own is `clearance/(1 - preload)`. `viscosity`: Pa·s, at working temperature.
    - `load`: steady, on the journal, (x, y) N. `speeds`: rad/s, rising, each above zero.
    - `pads`: angles of their middles, from x towards y, rad; grooves are what the pads leave free. By default
      two halves, below and above. `arc`: of a pad, rad.
    - `preload`: by how much of its clearance a pad is moved inward, 0 to below 1. `offset`: where along its
      arc, from the edge that the turning meets first, 0 to 1: half for symmetrical lobes, 1 for offset halves.
      `arc`, `preload` and `offset` are one number, or one for each pad.
    - `around` and `along`: intervals of the grid over a pad and over half its length, even. Those by default
      are good to 1e-3 of the place and half a percent of coefficients, of pads of 160 degrees.

    Grooves and ends are at ambient pressure, the oil is laminar and of one viscosity, no pressure is below
    ambient and a film ends where its slope vanishes (Reynolds'). Damping is that of small motions; torque
    about the axis is left out (`power` of `working_point` tells it). Turning the other way it is seen in a
    mirror, as a `SpeedDependentSupport`. Its work counts as that of a load in the energy audit.

    Sources: Lund & Thomsen, Topics in Fluid Film Bearing and Rotor Bearing System Design (ASME, 1978); Lund,
    J. Tribology 109 (1987) 37; Someya (ed.), Journal-Bearing Databook (1989).
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    length: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    load: Float[Array, "2"] = parameter("N", shapes=((2,),))
    speeds: Float[Array, " n"] = parameter("rad/s", positive=True, shapes=((None,),))
    pads: Float[Array, " p"] = parameter("rad", shapes=((None,),), default=_HALVES)
    arc: Float[Array, ""] | Float[Array, " p"] = parameter(
        "rad", positive=True, shapes=((), (None,)), default=_ARC
    )
    preload: Float[Array, ""] | Float[Array, " p"] = parameter(
        nonnegative=True, shapes=((), (None,)), default=0.0
    )
    offset: Float[Array, ""] | Float[Array, " p"] = parameter(
        nonnegative=True, shapes=((), (None,)), default=0.5
    )
    around: int = option(even, default=128)
    along: int = option(even, default=6)

    def faults(self) -> Iterator[str]:
        yield from pad_faults(self)

    def _pads(self) -> Pads:
        arc, preload, offset = (
            jnp.broadcast_to(x, self.pads.shape) for x in (self.arc, self.preload, self.offset)
        )
        pivot = self.pads + (offset - 0.5) * arc
        own = self.clearance / (1 - preload)
        return Pads(
            self.pads,
            pivot,
            arc,
            own,
            preload,
            0.5 * self.diameter,
            self.length,
            self.viscosity,
            self.clearance,
        )

    def _at(self, load: Array, speed: Array) -> tuple[PadPoint, Array]:
        """And how much of the load is missed."""
        pads, grid = self._pads(), (self.around, self.along)
        found = balanced(pads, load, speed, grid, tilting=False)
        slopes, flow = looked_at(pads, found, speed, grid)
        K, C = slopes.stiffness[:2, :2], slopes.damping[:2, :2]
        return pad_point(pads, load, speed, found, K, C, flow), found.missed

    def working_point(
        self, speed: Float[Array, ""] | float, load: Float[Array, "2"] | Any = None
    ) -> PadPoint:
        """Equilibrium at a `speed` of the journal (rad/s) under its `load`, or another one, (x, y) N.
        Differentiable.

        Raises `InputError` for parameters that a machine refuses too, where speed or load is not finite or
        zero, and where no equilibrium is found.
        """
        refuse(problems(self, "FixedPadBearing"))
        given = self.load if load is None else jnp.asarray(load, float)
        speed = jnp.asarray(speed, float)
        for name, value, size in (("load", given, 1), ("speed", speed, 0)):
            number = known(value)
            if number is not None and not (
                number.ndim == size and np.isfinite(number).all() and np.any(number != 0)
            ):
                raise InputError(f"{name} must be finite and not zero, but is {number}")
        point, missed = _point(self, given, speed)
        self._borne(missed, speed)
        return point

    def support(self, speeds: Float[Array, " n"] | Any = None) -> SpeedDependentSupport:
        """A support with these coefficients at its `speeds`, or others, rad/s. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, for fewer than two speeds or ones that
        do not rise from above zero, and where no equilibrium is found at one of them.
        """
        refuse(problems(self, "FixedPadBearing"))
        if speeds is not None:
            speeds = numbers("rad/s", least=0.0, fewest=2, rising=True)(speeds, "speeds")
            self = eqx.tree_at(lambda b: b.speeds, self, jnp.asarray(speeds, float))
            refuse(problems(self, "FixedPadBearing"))
        found, missed = _over_speeds(self)
        number = known(missed)
        if number is not None:
            worst = int(np.argmax(np.where(np.isnan(number), np.inf, number)))
            self._borne(missed[worst], self.speeds[worst])
        return found

    def _borne(self, missed: Array, speed: Array) -> None:
        number = known(missed)
        if number is not None and not number < 1e-6:
            raise InputError(
                f"load must be one that the pads bear, but no equilibrium is found at a speed of "
                f"{float(speed):g} rad/s: a smaller load, a higher speed, or pads where the load points"
            )

    def prepared(self) -> SpeedDependentSupport:
        return _rows(self)[0]

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return self.prepared().forces(t, motions, state)

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return jnp.abs(motions[-1][1][5]), self.speeds, "rad/s"


@lightly_compiled
def _point(bearing: FixedPadBearing, load: Array, speed: Array) -> tuple[PadPoint, Array]:
    point, missed = bearing._at(load, speed)
    met = missed < 1e-6
    return jax.tree.map(lambda x: jnp.where(met, x, jnp.nan), point), missed


def _rows(bearing: FixedPadBearing) -> tuple[SpeedDependentSupport, Array]:
    def row(speed):
        point, missed = _point(bearing, bearing.load, speed)
        return point.stiffness, point.damping, missed

    K, C, missed = jax.lax.map(row, bearing.speeds)
    wide = ((0, 0), (0, 4), (0, 4))
    return SpeedDependentSupport(bearing.speeds, jnp.pad(K, wide), jnp.pad(C, wide)), missed


_over_speeds = lightly_compiled(_rows)
