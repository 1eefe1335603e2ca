"""Supports whose coefficients depend on the frequency of the whirl as well as on the speed."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Inertial, Motion, Tabulated, Vec6
from ...profiles.monotone import interpolate, table_faults
from .support import SpeedDependentSupport

_TABLE = ((None, None, 6), (None, None, 6, 6))
_NAMES = ("stiffness", "damping", "mass")


class WhirlDependentSupport(AbstractAttachment, Tabulated, Inertial):
    """Holds a station to the ground with coefficients over speed AND whirl frequency: tilting pads, seals of
    gas with holes or honeycomb.

    The force is `-K q - C v - M a`. `speeds` (n,) and `frequencies` (m,), rad/s, zero or positive, increase;
    `stiffness`, `damping` and `mass` (none, where it is left out) have six numbers (x, y, z, psi, theta,
    phi) or a full 6x6 for each speed and frequency, SI: (n, m, 6) or (n, m, 6, 6). Between, a monotone cubic
    over the frequency, then over the speed; constant outside. Places, the sense of turning and the account of
    the energy as for `SpeedDependentSupport`.

    Which frequency counts:

    - in a run, and in `linearize`, that of the spin (synchronous whirl), or `whirl`, rad/s, where it is
      given: a law over frequency is none over time, and other whirls are not met exactly;
    - in `unbalance_response` and `critical_speeds` that of the spin, which is exact there;
    - in `frequency_response` that of the force; in `campbell` and `linear.matched_modes` that of each mode
      itself. What else asks for eigenvalues refuses such a machine.

    `fitted()` turns it into a `SpeedDependentSupport` with inertia, which a run meets at all frequencies as
    well as the fit does. Source: damped eigenvalues with coefficients at their own frequency, Lund, J. Eng.
    Ind. 96 (1974) 509; synchronously reduced coefficients, API RP 684.
    """

    speeds: Float[Array, " n"] = parameter("rad/s", nonnegative=True, shapes=((None,),))
    frequencies: Float[Array, " m"] = parameter("rad/s", nonnegative=True, shapes=((None,),))
    stiffness: Float[Array, "n m 6"] | Float[Array, "n m 6 6"] = parameter(
        shapes=_TABLE, label="N/m and N*m/rad"
    )
    damping: Float[Array, "n m 6"] | Float[Array, "n m 6 6"] = parameter(
        shapes=_TABLE, label="N*s/m and N*m*s/rad"
    )
    mass: Float[Array, "n m 6"] | Float[Array, "n m 6 6"] | None = parameter(
        shapes=_TABLE, optional=True, default=None, label="kg and kg*m^2"
    )
    whirl: Float[Array, ""] | None = parameter(
        "rad/s", nonnegative=True, optional=True, default=None
    )

    def faults(self) -> Iterator[str]:
        for name in _NAMES:
            table = getattr(self, name)
            if table is None:
                continue
            for axis, rows in (("speeds", table), ("frequencies", np.moveaxis(table, 1, 0))):
                unit, given = "rad/s", getattr(self, axis)
                found = list(table_faults(given, rows, (axis, name), unit))
                yield from found
                if found:
                    return
        if self.mass is not None and (np.any(self.mass[..., 5]) or np.any(self.mass[:, :, 5])):
            yield "mass must be zero for phi, which the support does not turn with"

    def at(self, whirl: Array | float) -> SpeedDependentSupport:
        """Its coefficients at one whirl frequency, rad/s, over speed."""

        def row(table: Array | None) -> Array | None:
            if table is None:
                return None
            return interpolate(self.frequencies, jnp.moveaxis(table, 1, 0), jnp.asarray(whirl))

        stiffness, damping, mass = (row(getattr(self, name)) for name in _NAMES)
        return SpeedDependentSupport(self.speeds, stiffness, damping, mass)

    def fitted(self) -> SpeedDependentSupport:
        """The constant K, C and M at each speed whose dynamic stiffness `K - w^2 M + i w C` comes nearest to
        the table's over its frequencies, by least squares: K, C, M of the literature ("KCM model"). Source:
        Al-Ghasem & Childs, J. Eng. Gas Turbines Power 128 (2006).
        """
        w = self.frequencies
        K, C = self.stiffness, self.damping
        real = K if self.mass is None else K - w.reshape(-1, *(1,) * (K.ndim - 2)) ** 2 * self.mass
        basis = jnp.stack([jnp.ones_like(w), -(w**2)], axis=1)
        scale = jnp.max(jnp.abs(basis), axis=0)
        inverse = jnp.linalg.pinv(basis / scale) / scale[:, None]
        stiffness, mass = (jnp.einsum("m,nm...->n...", row, real) for row in inverse)
        weight = w**2 / jnp.sum(w**2)
        damping = jnp.einsum("m,nm...->n...", weight, C)
        turns = jnp.ones(6).at[5].set(0.0)
        mass = mass * (turns if mass.ndim == 2 else turns[:, None] * turns)
        return SpeedDependentSupport(self.speeds, stiffness, damping, mass)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return self._now(motions).forces(t, motions, state)

    def inertia(
        self, t: Float[Array, ""], motions: tuple[Motion, ...]
    ) -> Float[Array, "6 6"] | None:
        return None if self.mass is None else self._now(motions).inertia(t, motions)

    def _now(self, motions: tuple[Motion, ...]) -> SpeedDependentSupport:
        return self.at(jnp.abs(motions[-1][1][5]) if self.whirl is None else self.whirl)

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return jnp.abs(motions[-1][1][5]), self.speeds, "rad/s"
