"""Journal bearings of fixed pads: grooved, elliptical, of three and four lobes, offset halves."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import option
from .pad_bearing import AbstractPadBearing, point_of
from .pad_faults import even
from .pad_point import PadPoint, pad_point
from .pads import Slopes, balanced, looked_at
from .support import SpeedDependentSupport, in_six

_HALVES = (-1.5707963267948966, 1.5707963267948966)
_ARC = 2.792526803190927  # 160 degrees


class FixedPadBearing(AbstractPadBearing):
    """A journal bearing of fixed pads: with axial grooves, elliptical (lemon), of three or four lobes, with
    offset halves. Reynolds' equation on each pad, of finite length; linear about where a load holds it.

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
      arc, from the edge that the turning meets first, 0 to 1: 0.5 for symmetrical lobes, 1 for offset halves.
      `arc`, `preload` and `offset` are one number, or one for each pad.
    - `around` and `along`: intervals of the grid over a pad and over half its length, even. Those by default
      are good to 1e-3 of the place and half a percent of coefficients, of pads of 160 degrees.
    - `thinning`, 1/K: where it is given, `viscosity` is that of the supply, and the oil warms by dT until
      what leaks takes along the part `carried` of the shear's power: `viscosity exp(-thinning dT)`,
      one temperature for all. `heat_capacity`: J/(m³·K). Of two known viscosities, thinning is
      `log(mu1/mu2)/(T2 - T1)`.

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
    thinning: Float[Array, ""] | None = parameter(
        "1/K", nonnegative=True, optional=True, default=None
    )
    heat_capacity: Float[Array, ""] = parameter("J/(m^3*K)", positive=True, default=1.7e6)
    carried: Float[Array, ""] = parameter(positive=True, default=1.0)
    around: int = option(even, default=128)
    along: int = option(even, default=6)

    def middles(self) -> Float[Array, " p"]:
        return self.pads

    def found_at(self, load: Array, speed: Array) -> tuple[PadPoint, Array]:
        grid, every = (self.around, self.along), jnp.ones(self.pads.shape, bool)

        def at(pads):
            found = balanced(pads, load, speed, grid)
            return found, *looked_at(pads, found.place, found.known, every, speed, grid)

        pads = self.warm(lambda pads: at(pads)[2])
        found, slopes, flow = at(pads)
        own = Slopes(slopes.stiffness[:2, :2], slopes.damping[:2, :2])
        return pad_point(pads, load, speed, found.place, own, own, flow), found.missed

    def tabulated(self) -> tuple[SpeedDependentSupport, Array]:
        def row(speed):
            point, missed = point_of(self, self.load, speed)
            return point.stiffness, point.damping, missed

        K, C, missed = jax.lax.map(row, self.speeds)
        return SpeedDependentSupport(self.speeds, in_six(K), in_six(C)), missed

    def support(self, speeds: Float[Array, " n"] | Any = None) -> SpeedDependentSupport:
        """A support with these coefficients at its `speeds`, or others, rad/s. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, for fewer than two speeds or ones that
        do not rise from above zero, and where no equilibrium is found at one of them.
        """
        return self.at_speeds(speeds)
