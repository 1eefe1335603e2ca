"""The shaft's angle as the clock: instants of given angles, and signals at equal steps of it."""

import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import BSpline, make_interp_spline
from scipy.optimize import elementwise

from ..core.arguments import number, positive
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import TURN
from . import checks

# Of the splines between samples.
_DEGREE = 5
# Rounding of an angle after thousands of turns is no reversal (rad).
_ROUNDING = 1e-9


class Turning:
    """Samples of a shaft's angle that never turns back.

    Between samples it is a quintic spline, as are signals: with 10 samples in a period both are right to
    3e-6 of their amplitude, with 5 to 3e-4. `sense` is -1 for a shaft that turns towards -phi; `turned` is
    `sense * angle`, which rises. Times are in s from the first sample. Raises `InputError` for an angle that
    reverses or makes no turn.
    """

    def __init__(self, angle, sample_rate):
        self.angle = checks.signal(angle, "angle")
        self.sample_rate = sample_rate
        ahead, behind = self.angle.max() - self.angle[0], self.angle[0] - self.angle.min()
        self.sense = 1.0 if ahead >= behind else -1.0
        turned = self.sense * self.angle
        back = np.flatnonzero(np.diff(turned) < -_ROUNDING)
        if back.size:
            row = int(back[0])
            raise InputError(
                f"`angle`: must rise (or fall) throughout, but the shaft turns back after sample {row}, at "
                f"{self.angle[row]:.6g} rad: cut the record there (one folded at 2 pi wants numpy.unwrap)"
            )
        self.turned = np.maximum.accumulate(turned)
        if self.turned[-1] - self.turned[0] < TURN:
            raise InputError(
                f"`angle`: must make a whole turn, but goes from {self.angle[0]:.4g} to "
                f"{self.angle[-1]:.4g} rad only: run longer (angles are in rad, not folded back at 2 pi)"
            )
        self._t = np.arange(self.angle.size) / self.sample_rate
        self._curve = spline(self._t, self.turned)

    def instants(self, turned: np.ndarray) -> np.ndarray:
        """s, at which `turned` has those values, all within the record."""
        shape, wanted = turned.shape, turned.ravel()
        after = np.searchsorted(self.turned, wanted, side="left").clip(1, self._t.size - 1)
        low, high = self._t[after - 1], self._t[after]
        below, above = self._curve(low) - wanted, self._curve(high) - wanted
        found = np.where(np.abs(below) <= np.abs(above), low, high)
        # a mark on a sample, within rounding, has no change of sign to be bracketed by
        inside = np.flatnonzero((below < 0) & (above > 0))
        if inside.size:
            root = elementwise.find_root(
                lambda t, mark: self._curve(t) - mark,
                (low[inside], high[inside]),
                args=(wanted[inside],),
            )
            found[inside] = root.x
        return found.reshape(shape)

    def marks(self, phase: float = 0.0) -> np.ndarray:
        """Values of `turned` (rad) at which the angle is 2 pi k + `phase`, within the record."""
        first, last = self.turned[[0, -1]] - self.sense * phase
        slack = _ROUNDING / TURN
        whole = np.arange(np.ceil(first / TURN - slack), np.floor(last / TURN + slack) + 1)
        return np.clip(TURN * whole + self.sense * phase, *self.turned[[0, -1]])

    def at(self, values: np.ndarray, instants: np.ndarray) -> np.ndarray:
        """A signal (nt, ...) at other instants (s)."""
        return spline(self._t, values)(instants)

    def top_speed(self) -> float:
        """rad/s, between two samples."""
        return float(np.max(np.diff(self.turned))) * self.sample_rate


def spline(t: np.ndarray, values: np.ndarray) -> BSpline:
    return make_interp_spline(t, values, k=_DEGREE)


def with_pair(x, y, angle, sample_rate) -> tuple[Turning, np.ndarray]:
    """The shaft's angle, and both signals side by side (nt, 2)."""
    turning = Turning(angle, sample_rate)
    both = [checks.signal(v, name, like=turning.angle) for v, name in ((x, "x"), (y, "y"))]
    return turning, np.stack(both, axis=1)


@takes(sample_rate=positive("Hz"), phase=number("rad"))
def turn_instants(
    angle: Float[Array | np.ndarray, " n"], sample_rate: float, phase: float = 0.0
) -> np.ndarray:
    """Instants (s from the first sample) at which a shaft passes the angle 2 pi k + `phase` (rad), once a
    turn, as a keyphasor sees it.

    `angle`: (nt,), rad, sampled at `sample_rate` (Hz), never turning back, not folded at 2 pi. Between
    samples it is a quintic spline. `pulse_times` does the same for the forward marks of an encoder in a
    run. Raises `InputError` for an angle that is not so.
    """
    turning = Turning(angle, sample_rate)
    return turning.instants(turning.marks(phase))
