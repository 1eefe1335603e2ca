"""Slopes of what condensed shafts do because they turn (`turning_forces`)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import from_turning, spin_speed
from ..core.turning import turned
from .between import Between, spread_between
from .condensed import Condensed


class TurningSlopes(eqx.Module):
    """The matrices of `Condensed` over all nodes of stations with mass; `circling`: `rotating` of `turned`;
    `shared`: as `turning_forces` takes it."""

    G: Between
    rotating: Between | None
    circling: Between | None
    shared: Float[Array, "m m"]
    invariant: bool = eqx.field(static=True)

    @classmethod
    def of(cls, condensed: Condensed, nodes: int) -> "TurningSlopes":
        def whole(X):
            return spread_between(X, condensed.nodes, nodes)

        rotating = circling = None
        if condensed.rotating is not None:
            rotating = whole(condensed.rotating)
            circling = jnp.einsum("cdkl,de->cekl", rotating, np.asarray(_turn()))
        lines = np.full(nodes, -1)
        lines[np.array(condensed.nodes)] = condensed.lines
        same = (lines[:, None] == lines) & (lines >= 0)
        shared = same / np.maximum(1, same.sum(axis=0))
        return cls(whole(condensed.G), rotating, circling, jnp.asarray(shared), condensed.invariant)

    def __call__(self, q: Float[Array, "6 m"], v: Float[Array, "6 m"]) -> tuple[Between, Between]:
        """By coordinates and by rates."""

        def spinning(x):
            return spin_speed(*(from_turning(*x) if self.invariant else x))

        spin = spinning(jnp.stack([q, v]))
        slopes = jax.vmap(jax.grad(spinning), in_axes=-1, out_axes=-1)(jnp.stack([q, v]))
        Gv = jnp.sum(self.G * v[None, :, None, :], axis=1)  # of each node's rates
        of_all = jnp.sum(Gv, axis=2)
        by_spin = [
            -0.5 * (of_all[:, None] * own)[..., None] * np.eye(q.shape[1])
            - 0.5 * Gv[:, None] * own[:, None, :]
            for own in slopes
        ]
        by_q, by_v = by_spin[0], by_spin[1] - 0.5 * self.G * (spin[:, None] + spin)
        if self.rotating is not None:
            q_too, v_too = self._circulatory(q, v)
            by_q, by_v = by_q + q_too, by_v + v_too
        return by_q, by_v

    def _circulatory(self, q: Array, v: Array) -> tuple[Between, Between]:
        assert self.rotating is not None and self.circling is not None
        B, turn, spin = self.rotating, turned(q), self.shared @ v[5]
        # of the force B (W x q), and of what turning at all the power is
        by_spin = jnp.sum(B * turn[None, :, None, :], axis=1)
        force = jnp.sum(by_spin * spin, axis=2) - jnp.sum(B * v[None, :, None, :], axis=(1, 3))
        by_q = self.circling * spin
        by_v = (by_spin @ self.shared)[:, None] * (np.arange(6) == 5)[:, None, None]
        own = jnp.sum(force[:, None] * _turn()[..., None], axis=0)
        about_q = jnp.sum(turn[:, None, :, None] * by_q, axis=0) + own[..., None] * np.eye(
            q.shape[1]
        )
        about_v = jnp.sum(turn[:, None, :, None] * (by_v - B), axis=0)

        def with_reaction(by, about):
            return jnp.concatenate([by[:5], by[5:] - (self.shared @ about)[None]])

        return with_reaction(by_q, about_q), with_reaction(by_v, about_v)


def _turn() -> np.ndarray:
    """`turned` as a matrix."""
    found = np.zeros((6, 6))
    found[[0, 1, 3, 4], [1, 0, 4, 3]] = -1.0, 1.0, -1.0, 1.0
    return found
