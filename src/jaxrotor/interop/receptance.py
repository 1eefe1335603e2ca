"""Foundations from their measured frequency responses."""

import warnings
from typing import Any

import equinox as eqx
import numpy as np

from ..core.arguments import numbers
from ..core.gate import takes
from ..core.result_text import shows
from ..core.threads import one_thread
from ..elements.bearings.measured_foundation import MeasuredFoundation
from .measured_response import fit_arguments, measured
from .partial_fractions import Rational, fitted, heads
from .passivity import least_power

# Singular values of a residue below this part of the largest are its rounding.
_RANK = 1e-9
# Of what is fed, as part of what is yielded: less is rounding.
_FED = 1e-9


@shows(poles="1/s", frequencies="Hz", damping_ratios="")
class FittedReceptance(eqx.Module):
    """A receptance `sum residues / (s - poles)`, fitted.

    - `poles`: (m,), 1/s, all stable. - `residues`: (k, k, m). - `error`: root mean square of what is left,
    as part of that of the response, weighted as the fit was. - `axes`: coordinates of each point.
    """

    poles: np.ndarray
    residues: np.ndarray
    error: float
    axes: int = eqx.field(static=True)

    @property
    def frequencies(self) -> np.ndarray:
        """Undamped natural frequencies of the pairs, Hz."""
        return np.abs(self.poles[np.imag(self.poles) > 0]) / (2 * np.pi)

    @property
    def damping_ratios(self) -> np.ndarray:
        """Of the pairs."""
        upper = self.poles[np.imag(self.poles) > 0]
        return -np.real(upper) / np.abs(upper)

    @property
    def passive(self) -> bool:
        """Whether it gives back no more than it takes, at any frequency that was looked at, as every
        foundation does. Noise that exceeds the damping between resonances makes a fit fail here."""
        return least_power(Rational(self.poles, self.residues))[1] >= -_FED

    @takes(frequencies=numbers("Hz"))
    def at(self, frequencies: Any) -> np.ndarray:
        """The fit at frequencies (n,) in Hz: (n, k, k), m/N. Raises `InputError` for what is no number."""
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies, float))
        return np.moveaxis(Rational(self.poles, self.residues).at(s), -1, 0)

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (d, d), B (d, k), C (k, d), real, with `C (s - A)⁻¹ B` the fit: as few states as the residues'
        ranks ask for."""
        A, B, C = [], [], []
        for k in heads(self.poles):
            p = self.poles[k]
            U, sizes, V = np.linalg.svd(self.residues[..., k])
            rank = max(1, int(np.sum(sizes > _RANK * sizes[0])))
            for i in range(rank):
                left, right = U[:, i] * sizes[i], V[i]
                if p.imag == 0:
                    A.append([[p.real]])
                    B.append(right.real[None])
                    C.append(left.real[:, None])
                else:  # x' = p x + right f, u = 2 Re(left x), x by its real and imaginary part
                    A.append([[p.real, -p.imag], [p.imag, p.real]])
                    B.append(np.stack([right.real, right.imag]))
                    C.append(np.stack([2 * left.real, -2 * left.imag], axis=1))
        size = sum(len(a) for a in A)
        whole_A, at = np.zeros((size, size)), 0
        for a in A:
            whole_A[at : at + len(a), at : at + len(a)] = a
            at += len(a)
        return whole_A, np.concatenate(B), np.concatenate(C, axis=1)

    def foundation(self, stiffness: Any, damping: Any = (0.0,) * 6) -> MeasuredFoundation:
        """With mounts of this stiffness and damping (SI): six numbers, or a row of six for each point. Warns
        where it is not `passive`, with the frequency: a machine with less damping than it is fed there grows
        without bound."""
        w, share = least_power(Rational(self.poles, self.residues))
        if share < -_FED:
            warnings.warn(
                f"the fitted receptance is not passive: at {w / (2 * np.pi):.4g} Hz it feeds "
                f"{-share:.2g} of what it yields, and a machine on it may vibrate without end; "
                "`fit_modes` fits what cannot",
                stacklevel=2,
            )
        return MeasuredFoundation(*self.matrices(), stiffness, damping, axes=self.axes)  # pyright: ignore


@fit_arguments
@one_thread
def fit_receptance(
    frequencies: Any,
    receptance: Any,
    order: int | None = None,
    axes: int = 3,
    relative: bool = False,
    beyond: bool = False,
) -> FittedReceptance:
    """A stable rational function with common poles through a measured receptance: relaxed vector fitting,
    then the least squares themselves.

    **Arguments:**

    - `frequencies`: (n,), Hz, rising. - `receptance`: (n, k, k), complex, m/N (rad/N·m for tilts):
    displacement over force of the points where machines will stand, measured without them; `[:, i, j]` at i
    by a force at j. An accelerance divided by `-(2 pi f)²` is one.
    - `order`: how many poles, two for each mode; left out, as many as pay for themselves by Schwarz's
    criterion (1978), which meets the noise and not more.
    - `axes`: how many of x, y, z, psi, theta, phi each point has: 2, 3 or 6.
    - `relative`: every response counts by its own size at each frequency, so that valleys are met as peaks
    are; else all count as they are, which suits noise that is the same everywhere.
    - `beyond`: with four more poles, at 1.5 and 4 times the end of the range, for what modes above it yield;
    where `order` is left out they are there if they pay.

    It falls off with 1/s² or faster, as what has mass does. Each response is fitted as it was measured:
    symmetric where it is symmetric, and with noise hardly ever `passive`; `fit_modes` always is. Warns where
    a tenth of the response is left. Sources: Gustavsen & Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052;
    Gustavsen, ibid. 21 (2006) 1587; Golub & Pereyra, Inverse Problems 19 (2003) R1.

    Raises `InputError` for another shape, for what is not finite, for fewer frequencies than unknowns.
    """
    place = "fit_receptance"
    given = measured(place, frequencies, receptance, order, axes, relative)
    found = fitted(*given, given.poles(order, beyond))
    k = np.shape(receptance)[1]
    return FittedReceptance(
        found.poles, found.residues.reshape(k, k, -1), given.error(place, found), axes
    )
