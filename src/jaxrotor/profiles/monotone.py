"""Monotone cubic through a table, held at its end values outside: for speeds, load curves and coefficients.

Between two rows the curve never leaves the band between their values; two rows are a straight line.
It is SciPy's and Matlab's PCHIP: inside, the slopes of Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5
(1984) 300; at the ends those of the parabola through three rows, kept monotone (Moler, Numerical
Computing with Matlab, 3.4).
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def slopes(x: Float[Array, " n"], y: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """The curve's slope at each row."""
    h = jnp.diff(x).reshape(-1, *(1,) * (y.ndim - 1))
    d = jnp.diff(y, axis=0) / h
    if x.shape[0] < 3:
        return jnp.concatenate([d, d])
    # weighted harmonic mean where neighbours agree in sign, else flat
    w = (h[:-1] + 2 * h[1:]) / (3 * (h[:-1] + h[1:]))
    same = d[:-1] * d[1:] > 0
    bottom = jnp.where(same, w * d[1:] + (1 - w) * d[:-1], 1.0)
    inner = jnp.where(same, d[:-1] * d[1:] / bottom, 0.0)
    first, last = end_slope(h[0], h[1], d[0], d[1]), end_slope(h[-1], h[-2], d[-1], d[-2])
    return jnp.concatenate([first[None], inner, last[None]])


def end_slope(h: Array, next_h: Array, d: Array, next_d: Array) -> Array:
    """Of a parabola through the three last rows, kept monotone: `h` and `d` are the width and secant of the
    end's interval and of its neighbour."""
    slope = ((2 * h + next_h) * d - h * next_d) / (h + next_h)
    turning = (d * next_d < 0) & (jnp.abs(slope) > 3 * jnp.abs(d))
    return jnp.where(slope * d > 0, jnp.where(turning, 3 * d, slope), 0.0)


def ends(x: Float[Array, " n"]) -> Float[Array, "2"]:
    """First and last row: a table over time kinks there, for it is held outside."""
    return x[jnp.array([0, -1])]


def row_frequency(x: Float[Array, " n"]) -> Float[Array, ""]:
    """rad/s, for the step to follow a table over time: two fall between the closest rows."""
    return 0.5 / jnp.min(jnp.diff(x))


def row_before(x: Float[Array, " n"], at: Float[Array, ""]) -> Array:
    """Index of the row at or before `at`, one that has a row after it."""
    i = jnp.searchsorted(x, jax.lax.stop_gradient(at), side="right") - 1
    return jnp.clip(i, 0, x.size - 2)


def interpolate(
    x: Float[Array, " n"], y: Float[Array, "n ..."], at: Float[Array, ""]
) -> Float[Array, "..."]:
    """The curve's value at `at`."""
    m = slopes(x, y)
    i = row_before(x, at)
    h = x[i + 1] - x[i]
    s = (at - x[i]) / h
    inside = (
        y[i]
        + (y[i + 1] - y[i]) * s**2 * (3 - 2 * s)
        + h * s * (1 - s) * (m[i] * (1 - s) - m[i + 1] * s)
    )
    # chosen, not clipped: at the very row a clip has no one derivative
    return jnp.where(at < x[0], y[0], jnp.where(at < x[-1], inside, y[-1]))


def table_faults(x, y, names: tuple[str, str], unit: str, rows: int = 2):
    """What is wrong with a table, in sentences: columns as long as each other, `x` increasing."""
    if x.shape[0] != y.shape[0] or x.shape[0] < rows:
        yield (
            f"{names[0]} and {names[1]} must be equally long, {_COUNTS[rows]} rows at least, but "
            f"have {x.shape[0]} and {y.shape[0]} rows"
        )
    elif not np.all(np.diff(x) > 0):
        row = int(np.argmin(np.diff(x)))
        yield (
            f"{names[0]} must increase, but row {row + 2} has {float(x[row + 1]):g} {unit} "
            f"after {float(x[row]):g} {unit}"
        )


_COUNTS = {2: "two", 3: "three"}
