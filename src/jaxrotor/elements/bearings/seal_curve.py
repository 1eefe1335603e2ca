"""What seals of liquid and of gas share: the force of their coefficients, and what stands for them within a
solve: the coefficients as curves over the speed, made once."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.protocol import AbstractAttachment, Inertial, Motion, Vec6
from .bulk_flow import Coefficients
from .support import in_six

# Rows for speeds above zero and their distance, in asinh(speed/scale): up to 11000 times the scale, with
# cubics between that are off by some millionths.
_ROWS, _STEP = 100, 0.1
# Central differences of the sixth order: with those of the fourth k is off by 5e-5 near rest.
_SLOPE = (-1 / 60, 3 / 20, -3 / 4, 0.0, 3 / 4, -3 / 20, 1 / 60)
# What a turning the other way changes the sign of: k and c, and m.
_ODD = (1.0, -1.0, 1.0, -1.0, 1.0, -1.0)


class SealCurve(AbstractAttachment, Inertial):
    """`table` and its `slope` over asinh(speed/scale), in rows from the fastest backward to the fastest
    forward, of six coefficients or, without inertia, four; `scale`, rad/s."""

    table: Float[Array, "n k"]
    slope: Float[Array, "n k"]
    scale: Float[Array, ""]

    def at(self, speed: Array) -> Coefficients:
        """Cubic between the rows, with their slopes."""
        place = jnp.arcsinh(speed / self.scale) / _STEP + _ROWS
        row = jnp.clip(jnp.floor(jax.lax.stop_gradient(place)).astype(int), 0, 2 * _ROWS - 1)
        s = place - row
        left, right = self.table[row], self.table[row + 1]
        inside = (
            left
            + (right - left) * s**2 * (3 - 2 * s)
            + s * (1 - s) * (self.slope[row] * (1 - s) - self.slope[row + 1] * s)
        )
        return Coefficients(*inside)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return seal_forces(self.at(motions[-1][1][5]), motions)

    def inertia(
        self, t: Float[Array, ""], motions: tuple[Motion, ...]
    ) -> Float[Array, "6 6"] | None:
        return seal_inertia(self.at(motions[-1][1][5]))


def seal_curve(found: Callable[[Array], Coefficients], scale: Array) -> SealCurve:
    """Of coefficients by the speed; `scale`, rad/s: about where the speed begins to tell."""
    # three rows more, for the slopes at the end
    speeds = scale * jnp.sinh(_STEP * jnp.arange(_ROWS + 4.0))
    ahead = jnp.stack(jax.tree.leaves(jax.lax.map(found, speeds)), axis=-1)
    whole = jnp.concatenate([ahead[:0:-1] * jnp.asarray(_ODD[: ahead.shape[1]]), ahead])
    slope = sum(c * whole[k : len(whole) - 6 + k] for k, c in enumerate(_SLOPE))
    return SealCurve(whole[3:-3], jnp.asarray(slope), scale)


def seal_forces(found: Coefficients, motions: tuple[Motion, ...]) -> tuple[Vec6, ...]:
    """On the first station; none on a second, whose speed it goes by."""
    q, v = motions[0]
    f = -square(found.K, found.k) @ q[:2] - square(found.C, found.c) @ v[:2]
    return (jnp.pad(f, (0, 4)), *(jnp.zeros(6) for _ in motions[1:2]))


def seal_inertia(found: Coefficients) -> Float[Array, "6 6"] | None:
    return None if found.M is None else in_six(square(found.M, found.m))


def square(direct: Array, cross: Array) -> Float[Array, "2 2"]:
    return jnp.stack([jnp.stack([direct, cross]), jnp.stack([-cross, direct])])
