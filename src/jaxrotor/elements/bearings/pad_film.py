"""The film of one pad: Reynolds' equation on an arc of finite length, cavitated where pressure and its slope
vanish.

With the journal's place and motion seen from the pad's centre of curvature, a pad knows nothing of preload
and tilt: its height is `c (1 - eps·n)`, and what it changes by is `-w·n`, w = e' - (spin/2) z × e as for a
whole bearing (film.py). In units of `12 mu R²/c³`, lengths along the bearing in halves of L:

    d/dtheta(H³ dp/dtheta) + (D/L)² d/dzeta(H³ dp/dzeta) = -w·n

p >= 0, and where p = 0 the equation may fall short (Reynolds', or Swift's and Stieber's, condition: a linear
complementarity problem of an M-matrix, solved by its active set). Volumes around the points of a grid, of
second order: even around the pad, finer towards the ends of the bearing, half of which is looked at.
Derivatives are those of the linear equations that are left, exact since p and its slope vanish where the
film ends. Sources: Swift, Proc. ICE 233 (1932); Lund & Thomsen, Topics in Fluid Film Bearing (ASME, 1978);
Hintermueller, Ito & Kunisch, SIAM J. Optim. 13 (2003) 865 (active sets).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .masked_solve import Factors, FivePoints, factors

# How far points along the bearing gather at its ends: 0 even, 1 as a sine's.
_GATHERED = 0.8
# Steps of the active set; it moves by a row at a time where a film forms anew.
_STEPS = 200


class Pad(NamedTuple):
    """One pad: `arc`, rad, with its middle at angle zero, and `slenderness`, L/D."""

    arc: Float[Array, ""]
    slenderness: Float[Array, ""]


class Film(NamedTuple):
    """`pressure` (n + 1, m + 1) on the grid, over `12 mu R²/c³`, from edge to edge and from the middle of the
    length to its end, in the unit of w; `free`: (n - 1, m), where the film is whole."""

    pressure: Float[Array, "n1 m1"]
    free: Bool[Array, "n m"]


def rows(pad: Pad, around: int) -> Float[Array, " n1"]:
    """Angles of the grid from the middle of the pad, rad."""
    return pad.arc * (jnp.arange(around + 1) / around - 0.5)


def along(length: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the half length from its middle (0) to its end (1), weights of an integral over them, and
    widths of the volumes around all but the last."""
    s = np.arange(length + 1) / length
    points = (1 - _GATHERED) * s + _GATHERED * np.sin(np.pi * s / 2)
    stretch = (1 - _GATHERED) + _GATHERED * np.pi / 2 * np.cos(np.pi * s / 2)
    sides = np.concatenate([[0.0], (points[1:] + points[:-1]) / 2])
    return points, _simpson(length) * stretch, np.diff(sides)


def _simpson(count: int) -> np.ndarray:
    """Weights over `count` (even) intervals of 0 to 1."""
    weights = np.full(count + 1, 2.0)
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    return weights / (3 * count)


def outward(angles: Array) -> Float[Array, "n 2"]:
    return jnp.stack([jnp.cos(angles), jnp.sin(angles)], axis=-1)


def heights(pad: Pad, eps: Float[Array, "2"], around: int) -> Float[Array, " n1"]:
    """Over c, at the rows of the grid."""
    return 1 - outward(rows(pad, around)) @ eps


def _operator(pad: Pad, eps: Array, grid: tuple[int, int]) -> FivePoints:
    around, length = grid
    step, angles = pad.arc / around, rows(pad, around)
    points, _, widths = along(length)
    middles = 1 - outward(0.5 * (angles[1:] + angles[:-1])) @ eps
    across = step * (1 - outward(angles[1:-1]) @ eps) ** 3 / pad.slenderness**2
    return FivePoints(
        middles**3 / step, jnp.asarray(widths), across, jnp.asarray(1 / np.diff(points))
    )


def _source(pad: Pad, w: Array, grid: tuple[int, int]) -> Float[Array, "n m"]:
    """What is squeezed in each volume."""
    around, length = grid
    step, angles = pad.arc / around, rows(pad, around)[1:-1]
    squeezed = 2 * jnp.sin(0.5 * step) * (outward(angles) @ w)
    return squeezed[:, None] * jnp.asarray(along(length)[2])


def whole(
    pad: Pad, eps: Array, w: Array, grid: tuple[int, int], first: Bool[Array, "n m"]
) -> tuple[Bool[Array, "n m"], Factors]:
    """Where the film is whole, from a first guess, and the factors of its equations; no derivative."""
    pad, eps, w = jax.lax.stop_gradient((pad, eps, w))
    operator, source = _operator(pad, eps, grid), _source(pad, w, grid)
    least = 1e-13 * jnp.max(jnp.abs(source))

    def step(carried):
        free, _, _, k = carried
        found = factors(operator, free)
        p = found.solve(source)
        rest = source - operator.apply(p)
        after = jnp.where(free, p > 0, rest > least)
        return after, found, jnp.all(after == free), k + 1

    start = factors(operator, first)
    same = jnp.all(jnp.isnan(source))
    free, found, _, _ = jax.lax.while_loop(
        lambda c: ~c[2] & (c[3] < _STEPS), step, (first, start, same, 0)
    )
    return free, found


def film(
    pad: Pad,
    eps: Array,
    w: Array,
    grid: tuple[int, int],
    known: tuple[Bool[Array, "n m"], Factors],
) -> Film:
    """The pressure where the film is known to be whole. Differentiable."""
    free, factored = known
    open_ = free.astype(float)
    operator = _operator(pad, eps, grid)

    def apply(p):
        return operator.apply(p * open_) * open_ + p * (1 - open_)

    def solve(_, b):
        return factored.solve(b) + b * (1 - open_)

    source = _source(pad, w, grid) * open_
    p = jax.lax.custom_linear_solve(apply, source, solve, symmetric=True)
    return Film(jnp.pad(p, ((1, 1), (0, 1))), free)


def force(pad: Pad, found: Film, grid: tuple[int, int]) -> Float[Array, "2"]:
    """On the journal, over `12 mu R³ L/c³`, in the unit of w."""
    around, length = grid
    mean = found.pressure @ jnp.asarray(along(length)[1])
    weights = pad.arc * jnp.asarray(_simpson(around)) * mean
    return -(weights @ outward(rows(pad, around)))


def leakage(pad: Pad, found: Film, eps: Array, w: Array, grid: tuple[int, int]) -> Float[Array, ""]:
    """What flows out of both ends, over `4 R³/L`, in the unit of w."""
    around, length = grid
    points, _, widths = along(length)
    angles = rows(pad, around)[1:-1]
    steep = found.pressure[1:-1, -2] / (points[-1] - points[-2])
    rest = pad.slenderness**2 * (1 - float(np.sum(widths)))
    out = (1 - outward(angles) @ eps) ** 3 * steep + rest * (outward(angles) @ w)
    return pad.arc / around * jnp.sum(jnp.where(found.free[:, -1], out, 0.0))


def shear(
    pad: Pad, found: Film, eps: Array, sense: Array, grid: tuple[int, int]
) -> Float[Array, ""]:
    """The integral of 1/H over the pad and its length, where the film is broken of the part of it that is
    left there: what had passed where it broke, in streamers. `sense`: of turning, 1 or -1."""
    around, length = grid
    h = heights(pad, eps, around)
    free = jnp.pad(found.free, ((1, 1), (0, 1)))
    free = jnp.concatenate([free[:, :-1], free[:, -2:-1]], axis=1)
    h, free = (jnp.where(sense < 0, x[::-1], x) for x in (h, free))
    index = jnp.arange(around + 1)[:, None]
    broke = jax.lax.cummax(jnp.where(free, index, 0), axis=0)
    left = jnp.where(free, 1.0, jnp.minimum(h[broke] / h[:, None], 1.0))
    mean = left @ jnp.asarray(along(length)[1])
    return pad.arc * jnp.sum(jnp.asarray(_simpson(around)) * mean / h)
