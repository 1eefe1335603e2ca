"""A foundation by its measured frequency response."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import option
from ...core.protocol import AbstractAttachment, Energetic, Motion, Powered, Settling, Vec6
from .foundation import DAMPING, STIFFNESS, each
from .mounts import mount_faults


class MeasuredFoundation(AbstractAttachment, Settling, Energetic, Powered):
    """A foundation that yields to forces as a state space does that was fitted to its measured receptance:
    `x' = A x + B f`, `u = C x`. `jr.interop.fit_receptance` makes one, and warns of one that is not passive.

    Attached to n stations. f are the forces of the mounts on the points under them and u the points'
    displacements (N and m; N·m and rad): the first `axes` coordinates of the first point, then of the next:
    2 for x and y, 3 for x, y and z, or all 6. In the others the points stand still. `C B` must be zero: a
    force does not make a speed jump. `stiffness` and `damping` of the mounts between stations and points:
    six numbers (x, y, z, psi, theta, phi), the same for all, or (n, 6), SI.

    A fit has no one energy: of the foundation the audit counts the work that passes its points, as drawn from
    outside; `energy` is the mounts'. One that is not passive may feed a machine until it grows without bound.
    """

    A: Float[Array, "m m"] = parameter(shapes=((None, None),))
    B: Float[Array, "m k"] = parameter(shapes=((None, None),))
    C: Float[Array, "k m"] = parameter(shapes=((None, None),))
    stiffness: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), units=STIFFNESS
    )
    damping: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), default=(0.0,) * 6, units=DAMPING
    )
    # how many coordinates of each point: x, y; x, y, z; or all six
    axes: int = option(whole(2, 6), default=3)

    def faults(self) -> Iterator[str]:
        m, k = self.A.shape[0], self.C.shape[0]
        if self.A.shape != (m, m) or self.B.shape != (m, k) or self.C.shape != (k, m):
            yield (
                "A, B and C must belong together, with as many forces as displacements, but are "
                f"{self.A.shape}, {self.B.shape} and {self.C.shape}"
            )
            return
        if self.axes not in (2, 3, 6) or k % self.axes:
            yield (
                f"axes must be 2 (x, y), 3 (x, y, z) or 6, and part the {k} displacements, but is {self.axes}"
            )
            return
        A, B, C = (np.asarray(x) for x in (self.A, self.B, self.C))
        size = np.linalg.norm(C, axis=1).max() * np.linalg.norm(B, axis=0).max()
        if np.abs(C @ B).max() > 1e-8 * size:
            yield "C B must be zero (a force does not make a speed jump), but is not"
        if np.linalg.eigvals(A).real.max() >= 0:
            yield (
                f"A must be stable, but has an eigenvalue with the real part "
                f"{np.linalg.eigvals(A).real.max():g} 1/s"
            )
        yield from mount_faults(self._points(), self.stiffness, self.damping)

    def initial(self) -> Float[Array, " k"]:
        return jnp.zeros(self.A.shape[0])

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        if len(motions) != self._points():  # the machine says so
            return (jnp.zeros(6),) * self._points()
        d, d_t = self._stretch(motions, state)
        return tuple(-pull for pull in self._pull(d, d_t))

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        pull = self._pull(*self._stretch(motions, state))
        return self.A @ state + self.B @ pull[:, : self.axes].ravel()

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        d, _ = self._stretch(motions, state)
        return 0.5 * jnp.sum(each(self.stiffness, self._points()) * d**2)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        _, d_t = self._stretch(motions, state)
        return jnp.sum(each(self.damping, self._points()) * d_t**2)

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Out of the foundation, through its points."""
        pull = self._pull(*self._stretch(motions, state))
        return -jnp.sum(pull * self._moved(self.C @ (self.A @ state)))

    def _points(self) -> int:
        return self.C.shape[0] // self.axes

    def _moved(self, u: Array) -> Float[Array, "n 6"]:
        return jnp.pad(u.reshape(-1, self.axes), ((0, 0), (0, 6 - self.axes)))

    def _stretch(self, motions: tuple[Motion, ...], state: Array) -> tuple[Array, Array]:
        """d and d' of the mounts, (n, 6)."""
        place, speed = self.C @ state, self.C @ (self.A @ state)
        q, v = (jnp.stack([motion[i] for motion in motions]) for i in (0, 1))
        return q - self._moved(place), v - self._moved(speed)

    def _pull(self, d: Array, d_t: Array) -> Float[Array, "n 6"]:
        points = self._points()
        return each(self.stiffness, points) * d + each(self.damping, points) * d_t
