"""A speed curve without a kink: a natural cubic spline, and one that smooths a measurement."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax.lax.linalg import tridiagonal_solve
from jaxtyping import Array, Float

from ..core.errors import InputError
from ..core.parameter import parameter
from .monotone import ends, row_before, row_frequency, table_faults
from .motion import AbstractMotion, Scalar

# Thinned, a spline may leave the smoothing one by this part of the noise that it took out.
_THINNING = 0.05


class SpeedSpline(AbstractMotion):
    """Speed as the natural cubic spline through given points, constant outside them.

    `times` (s) increase strictly, three at least; `speeds` in rad/s. Inside, the acceleration is
    smooth and the jerk continuous; at both ends the acceleration jumps to zero. Unlike a
    `SpeedTable` it may overshoot between rows. Each evaluation solves a tridiagonal system as long
    as the table: some dozen rows are meant, `smoothed` makes them of a long record. Source: de
    Boor, A Practical Guide to Splines, ch. IV (free end conditions).
    """

    times: Float[Array, " n"] = parameter("s", shapes=((None,),))
    speeds: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.times, self.speeds, ("times", "speeds"), "s", rows=3)

    def _curvatures(self) -> Float[Array, " n"]:
        """The second derivative of the speed at each row, zero at both ends."""
        h = jnp.diff(self.times)
        bend = jnp.diff(jnp.diff(self.speeds) / h)
        zero, one = jnp.zeros(1), jnp.ones(1)
        lower = jnp.concatenate([zero, h[:-1], zero])
        main = jnp.concatenate([one, 2 * (h[:-1] + h[1:]), one])
        upper = jnp.concatenate([zero, h[1:], zero])
        right = jnp.concatenate([zero, 6 * bend, zero])
        return tridiagonal_solve(lower, main, upper, right[:, None])[:, 0]

    def position(self, t: Scalar) -> Scalar:
        x, y, c = self.times, self.speeds, self._curvatures()
        h = jnp.diff(x)
        areas = h * (y[:-1] + y[1:]) / 2 - h**3 * (c[:-1] + c[1:]) / 24
        before = jnp.concatenate([jnp.zeros(1), jnp.cumsum(areas)])
        i = row_before(x, t)
        s = (t - x[i]) / h[i]
        inside = before[i] + h[i] * (
            y[i] * (s - s**2 / 2)
            + y[i + 1] * s**2 / 2
            - h[i] ** 2 / 6 * c[i] * (s**2 - s**3 + s**4 / 4)
            - h[i] ** 2 / 6 * c[i + 1] * (s**2 / 2 - s**4 / 4)
        )
        after = before[-1] + y[-1] * (t - x[-1])
        return y[0] * x[0] + jnp.where(
            t < x[0], y[0] * (t - x[0]), jnp.where(t < x[-1], inside, after)
        )

    def jumps(self) -> Float[Array, " n"]:
        return ends(self.times)

    def top_frequency(self) -> Float[Array, ""]:
        return row_frequency(self.times)

    @classmethod
    def smoothed(cls, times: Any, speeds: Any, lam: float | None = None) -> "SpeedSpline":
        """A spline through a measured, noisy record of speed (s, rad/s), with few points.

        `lam`: the weight of smoothness, the penalty on the squared second derivative of speed; left
        out, it is found by generalised cross validation (scipy's `make_smoothing_spline`). The
        points of the spline are then as few as keep it within a twentieth of the noise. Raises
        `InputError` for lists that are not equally long, rising and finite, five rows at least, and for
        a negative `lam`.
        """
        from scipy.interpolate import CubicSpline, make_smoothing_spline

        times, speeds = _record(times, speeds)
        if lam is not None and not (isinstance(lam, (int, float)) and 0 <= lam < np.inf):
            raise InputError(f"SpeedSpline.smoothed: lam must be zero or positive, but is {lam!r}")
        smooth = make_smoothing_spline(times, speeds, lam=lam)
        wanted = smooth(times)
        noise = np.sqrt(np.mean((speeds - wanted) ** 2))
        allowed = max(_THINNING * noise, 1e-6 * np.max(np.abs(wanted)))
        rows = np.array([0, times.size // 2, times.size - 1])
        while True:
            few = CubicSpline(times[rows], wanted[rows], bc_type="natural")
            off = np.abs(few(times) - wanted)
            # a point more in every stretch that is not met, where it is missed most
            worst = [i + int(np.argmax(off[i:j])) for i, j in zip(rows[:-1], rows[1:])]
            more = [i for i in worst if off[i] > allowed]
            if not more:
                return cls(times[rows], wanted[rows])
            rows = np.union1d(rows, more)


def _record(times: Any, speeds: Any) -> tuple[np.ndarray, np.ndarray]:
    """A measured record as two columns, or an `InputError`."""
    place = "SpeedSpline.smoothed"
    try:
        x, y = np.asarray(times, float), np.asarray(speeds, float)
    except (TypeError, ValueError):
        raise InputError(f"{place}: times and speeds must be lists of numbers") from None
    if x.ndim != 1 or y.shape != x.shape or x.size < 5:
        raise InputError(
            f"{place}: times and speeds must be equally long lists, five rows at least, but have "
            f"the shapes {x.shape} and {y.shape}"
        )
    bad = ~(np.isfinite(x) & np.isfinite(y))
    if np.any(bad):
        row = int(np.argmax(bad))
        raise InputError(
            f"{place}: row {row + 1} is not finite, {x[row]:g} s and {y[row]:g} rad/s: leave it out"
        )
    faults = list(table_faults(x, y, ("times", "speeds"), "s"))
    if faults:
        raise InputError(f"{place}: {faults[0]}: sort the rows and leave out repeated ones")
    return x, y
