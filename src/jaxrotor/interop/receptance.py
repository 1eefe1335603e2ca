"""Foundations from their measured frequency responses."""

from typing import Any

import equinox as eqx
import numpy as np

from ..core.arguments import numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..elements.bearings.measured_foundation import MeasuredFoundation
from .vector_fitting import Rational, vector_fit

# Singular values of a residue below this part of the largest are its rounding.
_RANK = 1e-9


class FittedReceptance(eqx.Module):
    """A receptance `sum residues / (s - poles)`, fitted.

    - `poles`: (m,), 1/s, all stable. - `residues`: (k, k, m). - `error`: root mean square of what is left,
    as part of that of the response, weighted as the fit was. - `axes`: coordinates of each point.
    """

    poles: np.ndarray
    residues: np.ndarray
    error: float
    axes: int = eqx.field(static=True)

    @takes(frequencies=numbers("Hz"))
    def at(self, frequencies: Any) -> np.ndarray:
        """The fit at frequencies (n,) in Hz: (n, k, k), m/N. Raises `InputError` for what is no number."""
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies, float))
        return np.moveaxis(Rational(self.poles, self.residues).at(s), -1, 0)

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (d, d), B (d, k), C (k, d), real, with `C (s - A)⁻¹ B` the fit: as few states as the residues'
        ranks ask for."""
        A, B, C = [], [], []
        k = 0
        while k < len(self.poles):
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
            k += 1 if p.imag == 0 else 2
        size = sum(len(a) for a in A)
        whole_A, at = np.zeros((size, size)), 0
        for a in A:
            whole_A[at : at + len(a), at : at + len(a)] = a
            at += len(a)
        return whole_A, np.concatenate(B), np.concatenate(C, axis=1)

    def foundation(self, stiffness: Any, damping: Any = (0.0,) * 6) -> MeasuredFoundation:
        """With mounts of this stiffness and damping (SI): six numbers, or a row of six for each point."""
        return MeasuredFoundation(*self.matrices(), stiffness, damping, axes=self.axes)  # pyright: ignore


@takes(
    frequencies=numbers("Hz", above=0.0, fewest=3, rising=True),
    order=whole(2, 400),
    axes=whole(2, 6),
    relative=None,
    receptance=None,
)
def fit_receptance(
    frequencies: Any, receptance: Any, order: int, axes: int = 3, relative: bool = False
) -> FittedReceptance:
    """A stable rational function with common poles through a measured receptance, by vector fitting.

    **Arguments:**

    - `frequencies`: (n,), Hz, rising. - `receptance`: (n, k, k), complex, m/N (rad/N·m for tilts):
    displacement over force of the points where machines will stand, measured without them; `[:, i, j]` at i
    by a force at j. An accelerance divided by `-(2 pi f)²` is one.
    - `order`: how many poles: two for each mode, and two or four for what lies beyond the measured
    frequencies.
    - `axes`: how many of x, y, z, psi, theta, phi each point has: 2, 3 or 6.
    - `relative`: every response counts by its own size at each frequency, so that valleys are met as peaks
    are; else all count as they are.

    It falls off with 1/s² or faster, as what has mass does. Each response is fitted as it was measured:
    symmetric where it is symmetric. Source: Gustavsen & Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052.

    Raises `InputError` for another shape, for what is not finite, for fewer frequencies than unknowns.
    """
    f, H = np.asarray(frequencies, float), np.asarray(receptance)
    place = "fit_receptance"
    if H.ndim != 3 or H.shape[0] != len(f) or H.shape[1] != H.shape[2]:
        raise InputError(
            f"{place}: receptance must have the shape ({len(f)}, k, k), but has {H.shape}"
        )
    if H.dtype.kind not in "iufc" or not np.all(np.isfinite(H)):
        raise InputError(f"{place}: receptance must be finite numbers")
    if axes not in (2, 3, 6) or H.shape[1] % axes:
        raise InputError(f"{place}: axes must be 2, 3 or 6 and part the {H.shape[1]} coordinates")
    if 2 * len(f) < 2 * order:
        raise InputError(f"{place}: {order} poles need {order} frequencies, but {len(f)} are given")
    if not np.any(H):
        raise InputError(f"{place}: receptance is zero throughout")
    flat = np.moveaxis(H, 0, -1).reshape(-1, len(f)).astype(complex)
    size = np.abs(flat)
    weights = np.ones_like(size) / size.max()
    if relative:
        weights = 1.0 / np.maximum(size, 1e-9 * size.max())
    found = vector_fit(2j * np.pi * f, flat, weights, order)
    left = weights * (found.at(2j * np.pi * f) - flat)
    error = np.sqrt(np.sum(np.abs(left) ** 2) / np.sum(np.abs(weights * flat) ** 2))
    return FittedReceptance(
        found.poles, found.residues.reshape(*H.shape[1:], -1), float(error), axes
    )
