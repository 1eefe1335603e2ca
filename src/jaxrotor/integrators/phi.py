"""The functions `phi_0 = exp, phi_k(z) = ∫_0^1 e^((1-s) z) s^(k-1)/(k-1)! ds` of a matrix.

By scaling and doubling: a Taylor series where the matrix is small, then
`phi_k(2z) = 2^-k [phi_0(z) phi_k(z) + Σ_j phi_j(z)/(k-j)!]`. The exponential itself is carried as
`phi_0 - 1`, whose doubling `F(2z) = 2F + F²` keeps the slow modes' digits, where squaring `phi_0`
would lose one bit each time (and 24 doublings are common here). Everything is differentiable.

The two highest may turn: `∫_0^1 e^((1-s) z) cos(W s) ds` and its sine (`turning_powers`).

Source: Skaflestad & Wright, Appl. Numer. Math. 59 (2009) 783, eq. (2.13).
"""

from math import factorial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Enough for norms up to 2^40; what is not needed is masked, so that the count may vary in a batch.
MAX_DOUBLINGS = 40
_TAYLOR_TERMS = 14
# Of the series of a turning power: rounding up to some 10 rad.
_TURN_TERMS = 18


def balance(A: Float[Array, "d d"]) -> Float[Array, " d"]:
    """A diagonal D (powers of two) for which `D⁻¹ A D` has rows and columns of like norm.

    The state mixes metres, radians per second and more: unbalanced, the norm that counts the
    doublings is far larger than the eigenvalues.
    """
    A = jnp.abs(jax.lax.stop_gradient(A))
    A = A - jnp.diag(jnp.diag(A))

    def sweep(_, d):
        scaled = A * d[None, :] / d[:, None]
        rows, columns = scaled.sum(1), scaled.sum(0)
        both = (rows > 0) & (columns > 0)
        ratio = jnp.where(both, rows / jnp.where(both, columns, 1.0), 1.0)
        # half the step that would even one row out: all rows move at once
        return d * 2.0 ** jnp.round(0.25 * jnp.log2(jnp.clip(ratio, 1e-30, 1e30)))

    return jax.lax.fori_loop(0, 30, sweep, jnp.ones(A.shape[0]))


def turning_powers(
    x: np.ndarray, turn: Float[Array, ""], first: int, count: int
) -> Float[Array, "..."]:
    """`u_n(x) = Σ_l (-1)^l turn^(2l) x^(n+2l)/(n+2l)!` for n = first, ..., stacked in front.

    `x^n/n!` where nothing turns; `cos(turn x)` is u_0 and `sin(turn x)/turn` u_1, and u_n + turn² u_(n+2) is
    x^n/n!. By its series: the closed form loses all digits where `turn x` is small. Up to 8 rad it has
    twelve digits. (A product with numbers known beforehand: term after term, these were a tenth of the
    operations of a run.)
    """
    n = np.arange(first, first + count).reshape(-1, *[1] * (np.ndim(x) + 1))
    l = np.arange(_TURN_TERMS + 1)
    factorials = np.cumprod([1.0, *range(1, first + count + 2 * _TURN_TERMS)])
    series = (-1.0) ** l * np.asarray(x)[..., None] ** (n + 2 * l) / factorials[n + 2 * l]
    square = (turn * turn)[None]
    powers = jnp.concatenate([jnp.ones(1), square])
    while powers.size <= _TURN_TERMS:
        square = square * square
        powers = jnp.concatenate([powers, square * powers])
    return jnp.asarray(series) @ powers[: _TURN_TERMS + 1]


def _shift(turn: Float[Array, ""] | None, count: int) -> Array | np.ndarray:
    """What the functions under the integrals are one step later, in terms of themselves: (p-1, p-1)."""
    powers = np.array([1 / factorial(n) for n in range(count)])
    n = np.arange(count)
    below = np.subtract.outer(n, n)
    shift = np.where(below >= 0, powers[np.maximum(below, 0)], 0.0)
    if turn is None:
        return shift
    turned = turning_powers(np.ones(()), turn, 0, count)
    last = jnp.where(below >= 0, turned[np.maximum(below, 0)], 0.0)[-2:]
    return jnp.concatenate([shift[:-2], last.at[0, -1].set(-(turn**2) * turned[1])])


class Phi(NamedTuple):
    """`flow`: phi_0 - 1; `means`: some columns of phi_1, phi_2, ..."""

    flow: Float[Array, "*l d d"]
    means: Float[Array, "*l p d m"]


def _double(phi: Phi, shift: Array | np.ndarray) -> Phi:
    """Of 2z from those of z. Side by side they take one product of matrices."""
    count, d, m = phi.means.shape
    beside = jnp.concatenate(
        [phi.flow, jnp.moveaxis(phi.means, 0, 1).reshape(d, count * m)], axis=1
    )
    product = phi.flow @ beside
    means = jnp.moveaxis(product[:, d:].reshape(d, count, m), 1, 0)
    rest = phi.means + jnp.einsum("pq,qab->pab", shift, phi.means)
    halves = 2.0 ** -np.arange(1.0, count + 1)[:, None, None]
    return Phi(2 * phi.flow + product[:, :d], jnp.asarray(halves) * (means + rest))


def phi_functions(
    z: Float[Array, "d d"], count: int, turn: Float[Array, ""] | None = None, levels: int = 1
) -> Float[Array, "l p d d"]:
    """`phi_0 - 1, phi_1, ..., phi_count` of `z/2^levels`, ..., `z/2`, `z`: (levels + 1, p, d, d)."""
    flow, means = phi_columns(z, count, turn, levels)
    return jnp.concatenate([flow[:, None], means], axis=1)


def phi_columns(
    z: Float[Array, "d d"],
    count: int,
    turn: Float[Array, ""] | None = None,
    levels: int = 1,
    first: int = 0,
) -> Phi:
    """`phi_functions`, but for phi_0 only the columns from `first` on, which is what weights are made of.

    With `turn` (rad) the last two have, in place of `s^n/n!`, the `turning_powers` of their n, so that
    with those before them they integrate `cos(turn s)` and `sin(turn s)` too. No inverse is taken of
    anything: `turn` may be an eigenvalue of z, as it is at a critical speed.
    """
    norm = jnp.max(jnp.sum(jnp.abs(jax.lax.stop_gradient(z)), axis=1), initial=0.0)
    doublings = jnp.ceil(jnp.log2(jnp.maximum(norm, 1e-300))) + 1
    doublings = jnp.clip(doublings, levels, MAX_DOUBLINGS)
    scale = 2.0**-doublings
    small, eye = z * scale, jnp.eye(z.shape[0])
    # values of the functions at 1, of all that the series asks for; before 1 alone stands nothing
    at_one = jnp.array([0.0] + [1 / factorial(n) for n in range(1, count + _TAYLOR_TERMS + 1)])
    own, skipped = None, jnp.zeros(count)
    if turn is not None:
        own = turn * scale
        turned = turning_powers(np.ones(()), own, count - 2, _TAYLOR_TERMS + 3)
        at_one = jnp.concatenate([at_one[: count - 2], turned])
        # s^n/n! of the highest that does not turn is u_n + turn² u_(n+2)
        skipped = skipped.at[count - 2].set(own**2)

    def series(top, value):
        return small @ top + eye * value, None

    top, _ = jax.lax.scan(series, eye * at_one[-1], at_one[count:-1], reverse=True)

    def downward(carry, x):
        phi, before = carry
        value, skip = x
        new = small @ phi + skip * before + eye * value
        return (new, phi), new

    begin = (top, jnp.zeros_like(top))
    _, rest = jax.lax.scan(downward, begin, (at_one[:count], skipped), reverse=True)
    means = jnp.concatenate([rest[1:], top[None]])[..., first:]

    def doubled(phi, i):
        return _double(phi, _shift(None if own is None else own * 2.0**i, count))

    def below(phi, i):
        return jax.lax.cond(i < doublings - levels, lambda: doubled(phi, i), lambda: phi), None

    def level(phi, i):
        phi = doubled(phi, doublings - levels + i)
        return phi, phi

    start = Phi(rest[0], means)
    lowest, _ = jax.lax.scan(below, start, jnp.arange(float(MAX_DOUBLINGS - levels)))
    _, rest = jax.lax.scan(level, lowest, jnp.arange(float(levels)))
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), lowest, rest)
