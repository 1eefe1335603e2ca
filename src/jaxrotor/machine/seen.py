"""Bodies in the coordinates of the force laws: chi in the place of phi (kinematics), unless a machine is
the paper's, which measures turning by phi."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.kinematics import from_turning, turning_lead_rates, with_last
from ..core.protocol import MASS_CENTRE, AbstractInertia, Vec6


class Seen(eqx.Module):
    """A station's own methods, which are written in the angles psi, theta, phi, in psi, theta, chi."""

    element: Any

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        a = self.element.acceleration(*from_turning(q, v), _to_angles(q, Q))
        return with_last(a, a[5] + turning_lead_rates(q, v, a)[1])

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return self.element.kinetic_energy(*from_turning(q, v))

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        weight = self.element.weight(from_turning(q, q)[0], gravity)
        return _to_angles(-q, weight)

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return self.element.height_energy(from_turning(q, q)[0], gravity)

    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        # a body that sits askew on its shaft is tilted against it but not turned: chi is the shaft's too
        return self.element.shift(port, from_turning(q, q)[0] if port == MASS_CENTRE else q)


def seen(element: Any, invariant: bool) -> Any:
    """The station as the machine's equations see it; `invariant`: by chi."""
    if not invariant or (isinstance(element, AbstractInertia) and element.small_tilts):
        return element
    return Seen(element)


def _to_angles(q: Vec6, Q: Vec6) -> Vec6:
    """A generalized force conjugate to (psi, theta, chi), conjugate to (psi, theta, phi)."""
    half = 0.5 * Q[5]
    return jnp.stack([Q[0], Q[1], Q[2], Q[3] + half * q[4], Q[4] + half * q[3], Q[5]])
