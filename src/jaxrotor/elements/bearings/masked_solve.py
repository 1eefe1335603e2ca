"""Linear equations on a grid with five points, some of which are held at zero: block elimination along it."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


class FivePoints(NamedTuple):
    """A symmetric positive operator on a grid of n rows by m columns.

    `conductance`: (n + 1,) between neighbours of a column, at both ends to what is zero beyond; `width`:
    (m,) of the columns; `across`: (n,) and `between`: (m,), whose products lead from each column to the
    next one, from the last to what is zero beyond.
    """

    conductance: Float[Array, " n1"]
    width: Float[Array, " m"]
    across: Float[Array, " n"]
    between: Float[Array, " m"]

    def apply(self, p: Float[Array, "n m"]) -> Float[Array, "n m"]:
        along = jnp.diff(jnp.pad(p, ((1, 1), (0, 0))), axis=0)
        flow = jnp.diff(self.conductance[:, None] * along, axis=0) * self.width
        leak = self.between * jnp.diff(jnp.pad(p, ((0, 0), (0, 1))), axis=1)
        leak = jnp.diff(jnp.pad(leak, ((0, 0), (1, 0))), axis=1)
        return -flow - self.across[:, None] * leak


class Factors(NamedTuple):
    """Of the operator with points held: `inverse` (n, m, m) of what is left of each row's block, `link`
    (n, m) from each row to the next, `free` (n, m)."""

    inverse: Float[Array, "n m m"]
    link: Float[Array, "n m"]
    free: Float[Array, "n m"]

    def solve(self, b: Float[Array, "n m"]) -> Float[Array, "n m"]:
        """Zero where a point is held."""

        def forth(carried, row):
            inverse, link, b = row
            y = b + carried
            return link * (inverse @ y), y

        def back(after, row):
            inverse, link, y = row
            x = inverse @ (y + link * after)
            return x, x

        zero = jnp.zeros_like(b[0])
        _, y = jax.lax.scan(forth, zero, (self.inverse, self.link, b * self.free))
        _, x = jax.lax.scan(back, zero, (self.inverse, self.link, y), reverse=True)
        return x * self.free


def factors(operator: FivePoints, free: Bool[Array, "n m"]) -> Factors:
    """By elimination from row to row; nothing is differentiated."""
    operator = jax.lax.stop_gradient(operator)
    m = free.shape[1]
    open_ = free.astype(float)
    sides = operator.conductance[1:] + operator.conductance[:-1]
    outward = operator.between + jnp.pad(operator.between[:-1], (1, 0))
    diagonal = sides[:, None] * operator.width + operator.across[:, None] * outward
    diagonal = open_ * diagonal + (1 - open_)
    step = operator.across[:, None] * operator.between[:-1] * open_[:, 1:] * open_[:, :-1]
    after = jnp.pad(open_[1:], ((0, 1), (0, 0)))
    link = operator.conductance[1:, None] * operator.width * open_ * after

    def row(carried, given):
        diagonal, step, link = given
        upper = (jnp.pad(step, (0, 1)))[:, None] * jnp.eye(m, k=1)
        block = diagonal * jnp.eye(m) - upper - upper.T - carried
        inverse = _inverse(block)
        return link[:, None] * inverse * link, inverse

    _, inverse = jax.lax.scan(row, jnp.zeros((m, m)), (diagonal, step, link))
    return Factors(inverse, link, open_)


def _inverse(a: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Of a positive matrix, by sweeps written out: no pivot is small."""
    for k in range(a.shape[0]):
        here = jnp.arange(a.shape[0]) == k
        pivot = 1 / a[k, k]
        row = jnp.where(here, 1.0, a[k]) * pivot
        column = jnp.where(here, 0.0, a[:, k])
        rest = jnp.where(here, 0.0, a) - column[:, None] * row
        a = jnp.where(here[:, None], row, rest)
    return a
