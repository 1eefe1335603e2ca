"""A periodic motion of a machine that turns at constant speed."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import numbers
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.result_text import shows
from ..machine.wiring import unknown
from ..simulation.state import State

# Angles of a turn among which a peak is looked for, per order, and steps from the largest to the peak itself.
_DENSE, _REFINED = 8, 3
# Multipliers as near to the unit circle as this are on it, where stability is told.
_ON_CIRCLE = 1e-9


@shows(without=("state", "internal", "coefficients"), speed="rad/s", largest_multiplier="")
class PeriodicMotion(eqx.Module):
    """A steady motion that repeats after `turns` turns of the shaft; it need not be stable.

    - `speed`: rad/s. `turns`: after which it repeats. `orders`: (K + 1,), per turn, from 0.
    - `coefficients`: (K + 1, stations, 6), complex, m and rad, stations in the machine's order: each
      coordinate is the sum over the orders of Re(coefficient e^(i order phi)), phi the angle of the drive
      (sense as in `unbalance_response`); its phi is measured from the turning line. `internal`: (K + 1, k),
      complex, of the elements' internal states.
    - `multipliers`: (d,), complex, the Floquet multipliers: by what factors small deviations grow in a
      period, the largest first.
    - `state`: at phi = 0, with which a run starts on it (`simulate(..., initial=motion.state)`).
    """

    speed: Float[Array, ""]
    coefficients: Complex[Array, "w stations 6"]
    internal: Complex[Array, "w k"]
    multipliers: Complex[Array, " d"]
    state: State
    orders: tuple[float, ...] = eqx.field(static=True)
    turns: int = eqx.field(static=True)
    stations: tuple[str, ...] = eqx.field(static=True)

    @property
    def largest_multiplier(self) -> Float[Array, ""]:
        """|multiplier| of the least damped deviation: above 1 it grows."""
        return jnp.max(jnp.abs(self.multipliers), axis=-1)

    @property
    def stable(self) -> Array:
        return self.largest_multiplier < 1.0 + _ON_CIRCLE

    def harmonics(self, place: str) -> Complex[Array, " w"]:
        """(K + 1,), of a coordinate such as `"disc.x"`, m or rad. Raises `InputError` for a name that the
        machine does not have."""
        return self.coefficients[(slice(None), *place_of(place, self.stations))]

    @takes(angles=numbers("rad"))
    def at(self, place: str, angles: Float[Array, " a"]) -> Float[Array, " a"]:
        """A coordinate over the angle of the drive (rad), m or rad. Raises `InputError` as `harmonics`
        does, and for angles that are not finite."""
        angles = jnp.atleast_1d(jnp.asarray(angles, float))
        return _sum(self.harmonics(place), np.asarray(self.orders), angles, jnp)

    def amplitude(self, place: str) -> Float[Array, ""]:
        """Half the distance between the extremes of a coordinate, m or rad. Raises `InputError` as
        `harmonics` does."""
        return amplitudes(self.harmonics(place)[None], self.orders, self.turns)[0]


def place_of(place: str, stations: tuple[str, ...]) -> tuple[int, int]:
    station, _, coordinate = str(place).rpartition(".")
    if coordinate not in COORDINATES:
        raise InputError(
            f"`{place}`: no such coordinate: write station.coordinate with one of the stations "
            f"{', '.join(stations)} and one of {', '.join(COORDINATES)}"
        )
    if station not in stations:
        raise InputError(f"`{place}`: {unknown('station', station, stations)}")
    return stations.index(station), COORDINATES.index(coordinate)


def _sum(coefficients: Any, orders: Any, angles: Any, xp: Any) -> Any:
    """(a,) of coefficients (w,), or of a row each (a, w)."""
    return xp.sum(coefficients * xp.exp(1j * angles[..., None] * orders), axis=-1).real


def amplitudes(coefficients: Any, orders: tuple[float, ...], turns: int) -> Any:
    """Of coefficients (p, w), of NumPy's or JAX's arrays: half the distance between the extremes of each
    motion, (p,). The angle of an extreme is looked for, and the value there has the derivatives (an extreme
    does not move with its angle)."""
    alone = isinstance(coefficients, np.ndarray)
    xp: Any = np if alone else jnp
    still = coefficients if alone else jax.lax.stop_gradient(coefficients)
    k, count = np.asarray(orders), _DENSE * len(orders) * turns + 64
    angles = 2 * np.pi * turns * np.arange(count) / count
    values = xp.real(still @ np.exp(1j * k[:, None] * angles))

    def extreme(sign: float) -> Any:
        angle = xp.asarray(angles)[xp.argmax(sign * values, axis=1)]
        for _ in range(_REFINED):
            slope = sign * _sum(1j * k * still, k, angle, xp)
            curve = sign * _sum(-(k**2) * still, k, angle, xp)
            move = xp.where(curve < 0, -slope / xp.where(curve < 0, curve, 1.0), 0.0)
            angle = angle + xp.clip(move, -angles[1], angles[1])
        return _sum(coefficients, k, angle, xp)

    return 0.5 * (extreme(1.0) - extreme(-1.0))
