"""Journal bearings of pads that tilt."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ...core.parameter import parameter
from ...core.part import option
from .pad_bearing import MISSED, AbstractPadBearing
from .pad_faults import even
from .pad_point import PadPoint, pad_point
from .pad_tilts import tilted
from .pads import Flow, Pads, Place, Slopes, looked_at
from .support import SpeedDependentSupport, in_six
from .whirl_dependent import WhirlDependentSupport


class TiltingPadBearing(AbstractPadBearing):
    """A journal bearing of pads that tilt about their pivots, by Reynolds' equation on each pad; linear about
    the equilibrium under a load, with coefficients that depend on the frequency of the whirl.

    Attached as a `FixedPadBearing` is, with the same film, `load`, `clearance`, `preload` and grid, and
    deflections measured from the equilibrium. In a machine it is a `WhirlDependentSupport`, whose rules say
    which frequency counts: that of the spin in runs and in unbalance response, each mode's own in `campbell`
    and `linear.matched_modes`.

    - `pads`: angles of their pivots, from x towards y, rad. `offset`: of the pivot along the arc, from the
      edge that the turning meets first; 0.5 central, 0.55 to 0.6 offset pivots. `arc`: of a pad, rad.
    - `speeds`, `frequencies`: rad/s, of the rows at which K and C are found once a run; frequencies of whirl
      from zero up. `whirl`: one frequency for all, where it is given.
    - `pad_inertia`: of a pad about its pivot, kg·m²; none by default.
    - `thinning`, 1/K: where it is given, `viscosity` is that of the supply, and the oil warms by dT until
      what leaks takes along the part `carried` of the shear's power: `viscosity exp(-thinning dT)`,
      as of fixed pads. `heat_capacity`: J/(m³·K). Of two known viscosities, thinning is
      `log(mu1/mu2)/(T2 - T1)`.

    Pivots are rigid and the pads stiff; tilting is all that they do. Pads that no pressure can hold, as upper
    ones without preload, are unloaded: they bear nothing and are left out (really they flutter).

    Sources: Lund, ASLE Trans. 7 (1964) 342 (pad assembly); Nicholas, Gunter & Allaire, ASLE Trans. 22 (1979)
    113; Parsell, Allaire & Barrett, ASLE Trans. 26 (1983) 222 (frequency); Someya (ed.), Journal-Bearing
    Databook (1989).
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    length: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    load: Float[Array, "2"] = parameter("N", shapes=((2,),))
    speeds: Float[Array, " n"] = parameter("rad/s", positive=True, shapes=((None,),))
    frequencies: Float[Array, " m"] = parameter("rad/s", nonnegative=True, shapes=((None,),))
    pads: Float[Array, " p"] = parameter("rad", shapes=((None,),))
    arc: Float[Array, ""] | Float[Array, " p"] = parameter(
        "rad", positive=True, shapes=((), (None,))
    )
    preload: Float[Array, ""] | Float[Array, " p"] = parameter(
        nonnegative=True, shapes=((), (None,)), default=0.0
    )
    offset: Float[Array, ""] | Float[Array, " p"] = parameter(
        nonnegative=True, shapes=((), (None,)), default=0.5
    )
    pad_inertia: Float[Array, ""] = parameter("kg*m^2", nonnegative=True, default=0.0)
    whirl: Float[Array, ""] | None = parameter(
        "rad/s", nonnegative=True, optional=True, default=None
    )
    thinning: Float[Array, ""] | None = parameter(
        "1/K", nonnegative=True, optional=True, default=None
    )
    heat_capacity: Float[Array, ""] = parameter("J/(m^3*K)", positive=True, default=1.7e6)
    carried: Float[Array, ""] = parameter(positive=True, default=1.0)
    around: int = option(even, default=64)
    along: int = option(even, default=6)

    def middles(self) -> Float[Array, " p"]:
        return self.pads - (self.offset - 0.5) * self.arc

    def _found(self, load: Array, speed: Array) -> tuple[Pads, Place, Slopes, Array, Flow, Array]:
        grid = self.around, self.along

        def at(pads):
            found = tilted(pads, load, speed, grid)
            return found, *looked_at(pads, found.place, found.known, found.loaded, speed, grid)

        pads = self.warm(lambda pads: at(pads)[2])
        found, slopes, flow = at(pads)
        return pads, found.place, slopes, found.loaded, flow, found.missed

    def found_at(self, load: Array, speed: Array) -> tuple[PadPoint, Array]:
        pads, place, slopes, loaded, flow, missed = self._found(load, speed)
        felt = condensed(slopes, loaded, self.pad_inertia, jnp.abs(speed))
        return pad_point(pads, load, speed, place, felt, slopes, flow), missed

    def tabulated(self) -> tuple[WhirlDependentSupport, Array]:
        def row(speed):
            _, _, slopes, loaded, _, missed = self._found(self.load, speed)
            inertia = self.pad_inertia
            each = jax.vmap(lambda w: condensed(slopes, loaded, inertia, w))(self.frequencies)
            return *(jnp.where(missed < MISSED, x, jnp.nan) for x in each), missed

        K, C, missed = jax.lax.map(row, self.speeds)
        tables = in_six(K), in_six(C)
        support = WhirlDependentSupport(self.speeds, self.frequencies, *tables, None, self.whirl)
        return support, missed

    def support(self, speeds: Float[Array, " n"] | Any = None) -> WhirlDependentSupport:
        """A support with these coefficients at its `speeds`, or others, rad/s, and its `frequencies`.
        Differentiable.

        Raises `InputError` for parameters that a machine refuses too, for fewer than two speeds or ones that
        do not rise from above zero, and where no equilibrium is found at one of them.
        """
        return self.at_speeds(speeds)

    def fitted(self) -> SpeedDependentSupport:
        """`support().fitted()`: constants K, C and M at each of its `speeds`, nearest over its `frequencies`.

        Raises `InputError` for parameters that a machine refuses too, and where no equilibrium is found.
        """
        return self.support().fitted()

    def synchronous(self) -> SpeedDependentSupport:
        """The coefficients of synchronous whirl at its `speeds` alone, reduced as is usual for unbalance
        response. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, and where no equilibrium is found.
        """
        points = [self.working_point(speed) for speed in self.speeds]
        K, C = (
            in_six(jnp.stack([getattr(p, name) for p in points]))
            for name in ("stiffness", "damping")
        )
        return SpeedDependentSupport(self.speeds, K, C)


def condensed(slopes: Slopes, loaded: Bool[Array, " p"], inertia: Array, whirl: Array) -> Slopes:
    """Of the journal alone, (2, 2), at one frequency of the whirl, rad/s: pads follow as they can."""
    K, C = slopes
    w2 = whirl**2
    own, drag = jnp.diag(K)[2:] - w2 * inertia, jnp.diag(C)[2:]
    below = jnp.where(loaded, own**2 + w2 * drag**2, 1.0)
    own, drag = (jnp.where(loaded, x / below, 0.0) for x in (own, drag))
    # products of what couples the journal to a pad and the pad to the journal, (p, 2, 2)
    pairs = [[jnp.einsum("ip,pj->pij", a[:2, 2:], b[2:, :2]) for b in (K, C)] for a in (K, C)]
    still, moving = pairs[0][0] - w2 * pairs[1][1], pairs[0][1] + pairs[1][0]
    held = jnp.einsum("p,pij->ij", own, still) + w2 * jnp.einsum("p,pij->ij", drag, moving)
    lost = jnp.einsum("p,pij->ij", own, moving) - jnp.einsum("p,pij->ij", drag, still)
    return Slopes(K[:2, :2] - held, C[:2, :2] - lost)
