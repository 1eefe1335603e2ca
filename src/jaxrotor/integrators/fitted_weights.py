"""Weights of the exponentially fitted Adams method (`fitted`): how past values of N are weighed in a step.

N is taken through its last k values as a mix of `1, s, ..., s^(k-3), cos(θ s), sin(θ s)`, s in steps, which
is integrated exactly with exp(hA). The integrals need no inverse and hold at a critical speed too (`phi`);
a corrected step has one power more.
"""

from collections.abc import Sequence
from math import factorial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.block_matrix import BlockMatrix, Places
from .phi import balance, phi_columns, turning_powers

# rad: with so much to a step the past values tell the pair apart well; at half a turn they cannot at all.
LARGEST_TURN = 2.0

# Functions that moments are kept of beyond the past values: one for the correction, and two pairs more for
# weights fitted to an angle beside theirs.
MORE = 5


class Parts(NamedTuple):
    """Of a state whose A does not mix them: the `rows` of each, of which those behind the leading
    `exact_rows` have an N."""

    rows: Places
    exact_rows: int

    @classmethod
    def whole(cls, size: int, exact_rows: int) -> "Parts":
        """All as one."""
        return cls((tuple(range(size)),), exact_rows)

    @property
    def single(self) -> bool:
        return len(self.rows) == 1

    @property
    def size(self) -> int:
        return sum(len(own) for own in self.rows)

    @property
    def with_N(self) -> Places:
        """Of each part, which of the rows that have an N."""
        n = self.exact_rows
        return tuple(tuple(i - n for i in own if i >= n) for own in self.rows)


class FittedWeights(eqx.Module):
    """Of one step, or stacked in front. m of the d rows have an N.

    `predict` acts on (y, N of the last k points, newest first); `ahead` extrapolates N to the step's end;
    `correct` acts on what the evaluation there differs from that.
    """

    predict: Float[Array, "d dkm"] | BlockMatrix
    correct: Float[Array, "d m"] | BlockMatrix
    ahead: Float[Array, " k"]


# Times the speed from which on steps are fitted to an excitation: what turns with the shaft is slow then.
_FAR = 3.0


def turn_of(
    speed: Float[Array, ""], h: Float[Array, ""], excitation: Float[Array, ""] | float = 0.0
) -> Float[Array, ""]:
    """The angle that a step of h (s) is fitted to, at a speed and with an excitation of so many rad/s."""
    turn, other = jnp.abs(speed * h), jnp.abs(excitation * h)
    far = (other >= _FAR * turn) & (other <= LARGEST_TURN)
    return jnp.clip(jnp.where(far, other, turn), 0.0, LARGEST_TURN)


class Moments(eqx.Module):
    """`flow`: e^(hA). `mean`: `h ∫_0^1 e^((1-s) hA) b(s) ds` for `b = s^n/n!`, n = 0, 1, ..., of which the
    last two turn (`turning_powers`). One column for each row that has an N."""

    flow: Float[Array, "d d"]
    mean: Float[Array, "q d m"]


def moments(
    A: Float[Array, "d d"],
    h: Float[Array, ""],
    turn: Float[Array, ""],
    order: int,
    exact_rows: int = 0,
    levels: int = 1,
) -> Moments:
    """What weights by `order` past values are mixed from, for steps of `h/2^levels`, ..., `h/2`, `h`:
    stacked. Those of `h` turn by `turn`, the shorter ones by as much less."""
    d = balance(A)
    balanced = h * A * d[None, :] / d[:, None]
    flow, means = phi_columns(balanced, order + MORE, turn, levels, exact_rows)
    back = d[:, None] / d[None, :]
    lengths = (h * 2.0 ** -np.arange(levels, -1.0, -1.0))[:, None, None, None]
    return Moments(flow * back + jnp.eye(A.shape[0]), lengths * means * back[:, exact_rows:])


def weights_of(own: Moments, past, after, ahead) -> FittedWeights:
    d, (k, _), m = own.flow.shape[0], past.shape, own.mean.shape[2]
    predict = jnp.einsum("jq,qab->ajb", past, own.mean).reshape(d, k * m)
    correct = jnp.einsum("q,qab->ab", after, own.mean)
    return FittedWeights(jnp.concatenate([own.flow, predict], axis=1), correct, jnp.asarray(ahead))


def weights_of_parts(own: Sequence[Moments], parts: Parts, past, after, ahead) -> FittedWeights:
    """As `weights_of`, of parts that do not mix, with moments of their own."""
    if parts.single:
        return weights_of(own[0], past, after, ahead)
    each: Any = [weights_of(moments, past, after, ahead) for moments in own]
    d, m, k = parts.size, parts.size - parts.exact_rows, past.shape[0]
    columns = tuple(
        (*rows, *(d + j * m + i for j in range(k) for i in with_N))
        for rows, with_N in zip(parts.rows, parts.with_N)
    )
    predict: Any = BlockMatrix(tuple(own.predict for own in each), parts.rows, columns)
    correct: Any = BlockMatrix(tuple(own.correct for own in each), parts.rows, parts.with_N)
    return FittedWeights(predict, correct, jnp.asarray(ahead))


def fitted_weights(
    A: Float[Array, "d d"],
    h: Float[Array, ""],
    turn: Float[Array, ""],
    order: int,
    exact_rows: int = 0,
) -> FittedWeights:
    """Weights of a regular step of h (s), in which the shaft turns by `turn` (rad, below π), by `order` past
    values (3 to 7). `exact_rows`: in how many leading rows the vector field is A's alone."""
    own = jax.tree.map(lambda x: x[-1], moments(A, h, turn, order, exact_rows))
    return weights_of(own, *fitted_mix(turn, order, turn))


# For n past points, in terms of the q = order + MORE functions of `Moments`: the mix that is one at each
# point and zero at the others, (order, q), zeros beyond n; the one that is zero at all and one at the step's
# end, (q,); and the values of the former there, (order,).
Mix = tuple[Any, Any, Any]


def fitted_mix(turn: Float[Array, ""], order: int, near: Float[Array, ""]) -> Mix:
    """`near`: the angle that the moments turn by. What turns by it are terms of a higher order in the pair
    that turns by `turn`: so weights for many angles are mixed from the moments of one near enough."""
    at, count = np.append(-np.arange(order, dtype=float), 1.0), order + MORE
    powers = np.stack([at**i / factorial(i) for i in range(count - 2)])
    values = jnp.concatenate([powers, turning_powers(at, near, count - 2, 2)])
    # u_n = s^n/n! - turn² u_(n+2), down to the functions that there are moments of
    w = -(turn**2)
    folded = jnp.stack([jnp.ones_like(w), w, w * w, w * w * w])

    def mixed(plain: int) -> Array:
        parts = np.zeros((len(folded), plain + 2, count))
        parts[0, :plain, :plain] = np.eye(plain)
        for row in (plain, plain + 1):
            for power, n in enumerate(range(row, count, 2)):
                parts[power, row, n] = 1.0
        return jnp.tensordot(folded, parts, 1)

    before, after = mixed(order - 2), mixed(order - 1)
    basis, full = before @ values, after @ values
    mix = _inverse(basis[:, :order], at[:order])
    return mix @ before, _inverse(full, at)[order] @ after, mix @ basis[:, order]


def _inverse(basis: Float[Array, "n n"], points: np.ndarray) -> Any:
    """Of the values at the points of functions that are powers but for the last two. (No call of LAPACK, of
    which several devices of one processor would wait for each other.)"""
    n = points.size
    powers = np.linalg.inv(np.stack([points**i / factorial(i) for i in range(n)]))
    own = basis[n - 2 :] @ powers
    corner, turned = own[:, n - 2 :], np.array([[0.0, 1.0], [-1.0, 0.0]])
    adjoint = turned @ corner.T @ turned.T
    last = adjoint / (0.5 * jnp.sum(corner * adjoint.T))
    polynomial, unit = np.arange(n) < n - 2, np.eye(n)
    lower = last @ (unit[n - 2 :] - jnp.where(polynomial, own, 0.0))
    return powers * polynomial + powers[:, n - 2 :] @ lower


def polynomial_mix(points: np.ndarray, order: int) -> Mix:
    n = points.size
    at = np.append(points, 1.0)
    powers = np.stack([at**i / factorial(i) for i in range(n + 1)], axis=1)
    mix = np.linalg.inv(powers[:n, :n])
    past, ahead, after = np.zeros((order, order + MORE)), np.zeros(order), np.zeros(order + MORE)
    past[:n, :n], ahead[:n] = mix.T, powers[n, :n] @ mix
    after[: n + 1] = np.linalg.inv(powers)[:, n]
    return past, after, ahead


class FirstSteps(NamedTuple):
    """How a history fills, from one value at the start; in regular steps.

    `ends` of the short steps; `which` of the `kinds` each is: its length, and the points behind it in its own
    length; `regular`: which ends are those of regular steps.
    """

    ends: np.ndarray
    which: np.ndarray
    kinds: list[tuple[float, tuple[float, ...]]]
    regular: np.ndarray


# Parts of a regular step by which the first ones go; and by how many halvings the very first is shorter.
_PARTS, FIRST_HALVINGS = 4, 9


def first_steps(order: int, span: int = 1) -> FirstSteps:
    """The first step is 2^-9 of a regular one, since it knows but one value of N; each next one doubles what
    has been done, by no more than four values (six so far apart are unstable). Parts follow until regular
    steps know enough regular points: each of the `span` samples in a step is the end of one."""
    parts = max(_PARTS, span)
    halvings = FIRST_HALVINGS - parts.bit_length() + 1
    growth = [2.0 ** (i - halvings) for i in range(halvings)]
    times = np.array([0.0, *growth, *range(1, parts * (order - 1) + 1)]) / parts
    lengths, kinds, which = np.diff(times), [], []
    for i, length in enumerate(lengths):
        points = (times[max(0, i + 1 - order) : i + 1][::-1] - times[i]) / length
        if points.size < order or np.any(points != -np.arange(order)):
            points = points[:4]
        kind = (float(length), tuple(points.tolist()))
        if kind not in kinds:
            kinds.append(kind)
        which.append(kinds.index(kind))
    ends = times[1:]
    return FirstSteps(ends, np.array(which), kinds, np.flatnonzero(ends % 1 == 0))
