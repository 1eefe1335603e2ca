"""Bodies in the coordinates of the force laws: chi in the place of phi (kinematics), unless a machine is
the paper's, which measures turning by phi."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.kinematics import (
    Rows,
    angles_of,
    from_turning,
    rows,
    turning_lead_acceleration,
    with_last,
)
from ..core.protocol import MASS_CENTRE, AbstractInertia, Vec6


class Seen(eqx.Module):
    """A station's own methods, which are written in the angles psi, theta, phi, in psi, theta, chi."""

    element: Any

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        at, rates = rows(q), rows(v)
        a = rows(self.element.acceleration(*from_turning(at, rates), _to_angles(at, Q)))
        return with_last(a, a[5] + turning_lead_acceleration(at, rates, a))

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return self.element.kinetic_energy(*from_turning(q, v))

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        at = rows(q)
        weight = self.element.weight(angles_of(at), gravity)
        return _to_angles(at, weight, -0.5)

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return self.element.height_energy(angles_of(q), gravity)

    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        # a body that sits askew on its shaft is tilted against it but not turned: chi is the shaft's too
        return self.element.shift(port, angles_of(q) if port == MASS_CENTRE else q)


def seen(element: Any, invariant: bool) -> Any:
    """The station as the machine's equations see it; `invariant`: by chi."""
    if not invariant or (isinstance(element, AbstractInertia) and element.small_tilts):
        return element
    return Seen(element)


def _to_angles(q: Rows, Q: Rows, share: float = 0.5) -> Vec6:
    """A generalized force conjugate to (psi, theta, chi), conjugate to (psi, theta, phi); with `share` -1/2
    the other way round."""
    Q = rows(Q)
    half = share * Q[5]
    return jnp.stack([Q[0], Q[1], Q[2], Q[3] + half * q[4], Q[4] + half * q[3], Q[5]])
