"""What a constant axial force and a constant torque do to the bending of a piece of shaft.

The force P (tension positive) goes along the centre line, so that its potential is `P (x'² + y'²)/2` a
metre (Nelson, J. Mech. Des. 102 (1980) 793; with shear this is Engesser's column). The torque T turns about
the axis of the sections: the twist of a section that also tilts is `chi' + (psi' theta - psi theta')/2` a
metre to second order, so that its potential is `T (psi' theta - psi theta')/2` where the moments at the ends
are semi-tangential, as all torques about the axis are here. Moments of another kind add circulatory moments
at both ends (Ziegler, Principles of Structural Stability (1968); Zorzi & Nelson, J. Mech. Des. 102 (1980)
158, whose torque is axial).
"""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.protocol import Motion, Vec6
from .segment import IN_X, IN_Y, WEIGHTS, Segment, both_planes

TorqueKind = Literal["semi-tangential", "axial", "follower"]
# Of T/2 (theta, -psi) on psi and theta at the right end, and against it at the left: what a moment of the
# kind has beyond a semi-tangential one, T (theta/2, psi/2, 1).
_BEYOND = {"semi-tangential": 0.0, "axial": -1.0, "follower": 1.0}
_ENDS = np.zeros((12, 12))
_ENDS[9, 10], _ENDS[10, 9] = 0.5, -0.5
_ENDS[3, 4], _ENDS[4, 3] = -0.5, 0.5


class Preload(eqx.Module):
    """Of one piece: N and N·m, `None` where there is none."""

    axial_force: Float[Array, ""] | None
    torque: Float[Array, ""] | None
    kind: TorqueKind = eqx.field(static=True)

    def stiffness(self, segment: Segment) -> Float[Array, "12 12"]:
        """What it adds to K, by the piece's own shapes."""
        _, slope, curvature, sheared = segment.shapes()
        dl = WEIGHTS * segment.length
        found = jnp.zeros((12, 12))
        if self.axial_force is not None:
            found += both_planes(slope + sheared[:, None], self.axial_force * dl)
        if self.torque is not None:
            theta, psi = IN_X.T @ slope, -IN_Y.T @ slope
            theta_z, psi_z = IN_X.T @ curvature, -IN_Y.T @ curvature
            half = 0.5 * self.torque * dl
            bilinear = jnp.einsum("ap,p,bp->ab", psi_z, half, theta)
            bilinear -= jnp.einsum("ap,p,bp->ab", psi, half, theta_z)
            found += bilinear + bilinear.T
            found -= _BEYOND[self.kind] * self.torque * _ENDS
        return found

    def energy(self, segment: Segment, a: Vec6, b: Vec6) -> Array:
        """The potential above, J, less that of a straight shaft; negative where it helps to bend."""
        _, slope, curvature, sheared = segment.shapes()
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        theta, psi = x @ slope, -(y @ slope)
        density = jnp.zeros_like(theta)
        if self.axial_force is not None:
            along, up = theta + x @ sheared, -psi + y @ sheared
            density += self.axial_force * (along**2 + up**2)
        if self.torque is not None:
            density += self.torque * ((-(y @ curvature)) * theta - psi * (x @ curvature))
        return 0.5 * segment.length * jnp.sum(WEIGHTS * density)

    def power_in(self, motions: tuple[Motion, ...]) -> Array:
        """W, of what the moments at both ends have beyond semi-tangential ones."""
        if self.torque is None:
            return jnp.zeros(())
        swept = [
            q[4] * v[3] - q[3] * v[4] for q, v in motions
        ]  # twice what the axis sweeps in a second
        return 0.5 * _BEYOND[self.kind] * self.torque * (swept[1] - swept[0])
