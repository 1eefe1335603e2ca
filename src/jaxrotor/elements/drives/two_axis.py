"""Windings on the two axes of a rotor, and the stator's terminals: Park's equations without the machine.

Amplitude-invariant, currents into the windings, rotor quantities referred to the stator. d and q turn with
the rotor, q a quarter of an electrical turn ahead of d.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

Scalar = Float[Array, ""]
Pair = Float[Array, "2"]


class Axis(NamedTuple):
    """The windings of one axis around one mutual flux: the stator's and n of the rotor. H."""

    stator_leakage: Scalar
    magnetizing: Scalar
    leakages: Float[Array, " n"]

    def _inverse(self) -> Scalar:
        """1/H, of the mutual flux with the rotor's windings closed."""
        return 1 / self.magnetizing + jnp.sum(1 / self.leakages)

    def subtransient(self) -> Scalar:
        """H: what the stator sees while the rotor's flux linkages stand."""
        return self.stator_leakage + 1 / self._inverse()

    def behind(self, rotor: Float[Array, " n"]) -> Scalar:
        """The flux linkage behind the subtransient inductance; linear in those of the rotor."""
        return jnp.sum(rotor / self.leakages) / self._inverse()

    def currents(
        self, stator: Scalar, rotor: Float[Array, " n"]
    ) -> tuple[Scalar, Float[Array, " n"]]:
        """A, of the stator and the rotor's windings, from their flux linkages."""
        current = (stator - self.behind(rotor)) / self.subtransient()
        mutual = stator - self.stator_leakage * current
        return current, (rotor - mutual) / self.leakages


def turned(pair: Pair) -> Pair:
    """A quarter of a turn ahead."""
    return jnp.stack([-pair[1], pair[0]])


class Terminals(NamedTuple):
    """What hangs at the stator. `voltage`: the grid's, in d and q, V. `closed`: its breaker. `joined`: lines
    b and c short-circuited. `angle`: of d ahead of phase a, electrical rad. `breaker_time`: s, within which
    an opened current dies."""

    voltage: Pair
    closed: Bool[Array, ""]
    joined: Bool[Array, ""]
    angle: Scalar
    breaker_time: Scalar

    def flux_rates(
        self, speed: Scalar, resistance: Scalar, inductances: Pair, current: Pair, flux, behind_rate
    ) -> Pair:
        """V: how the stator's flux linkages change. `speed`: electrical, rad/s; `inductances`: the
        subtransient ones; `behind_rate`: of the flux linkages behind them.

        A closed line has the grid's voltage. In an open one the current, as the stator sees it, decays with
        the breaker's time, and the voltage is what that takes. With b and c joined there is no voltage
        between them, which lies across phase a's axis, and along that axis either the grid's or an open
        phase.
        """
        along = jnp.stack([jnp.cos(self.angle), -jnp.sin(self.angle)])  # the axis of phase a
        voltage = jnp.where(self.joined, along * (along @ self.voltage), self.voltage)
        closed = voltage - resistance * current - speed * turned(flux)
        # di/dt as the stator sees it is that in d and q, and what turning adds
        fading = -current / self.breaker_time - speed * turned(current)
        open_ = inductances * fading + behind_rate
        # one line open: so much voltage along phase a that its current fades
        without = closed - along * (along @ voltage)
        lack = along @ (fading - (without - behind_rate) / inductances)
        single = without + along * lack / (along @ (along / inductances))
        return jnp.where(self.closed, closed, jnp.where(self.joined, single, open_))
