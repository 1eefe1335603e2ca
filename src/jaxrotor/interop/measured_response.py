"""What fits of a measured receptance begin with: its checks, its weights, its poles; and how they end."""

import warnings
from typing import Any, NamedTuple

import numpy as np

from ..core.arguments import flag, numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from .partial_fractions import Rational
from .pole_count import PoleSearch

# A fit that leaves more of the response than this part is told.
_POOR = 0.1

# What every fit is asked with.
fit_arguments = takes(
    frequencies=numbers("Hz", above=0.0, fewest=3, rising=True),
    order=whole(2, 400),
    axes=whole(2, 6),
    relative=flag,
    beyond=flag,
    receptance=None,
)


class Measured(NamedTuple):
    """A receptance at s (n,), 1/s, one response a row: `responses` and `weights` (h, n)."""

    s: np.ndarray
    responses: np.ndarray
    weights: np.ndarray

    def poles(self, order: int | None, beyond: bool) -> np.ndarray:
        """So many, or as many as are found; then those beyond the range."""
        search = PoleSearch(*self)
        return search.chosen() if order is None else search.of(order, beyond)

    def error(self, place: str, found: Rational) -> float:
        """Root mean square of what is left, as part of that of the response. Warns where it is much."""
        left = self.weights * (found.at(self.s) - self.responses)
        whole = np.sum(np.abs(self.weights * self.responses) ** 2)
        error = float(np.sqrt(np.sum(np.abs(left) ** 2) / whole))
        if error > _POOR:
            warnings.warn(
                f"{place}: {100 * error:.0f} % of the response are left: noise, or too few poles",
                stacklevel=5,
            )
        return error


def measured(
    place: str,
    frequencies: Any,
    receptance: Any,
    order: int | None,
    axes: int,
    relative: bool,
    together: bool = False,
) -> Measured:
    """`relative`: weighted by the size of each response at each frequency, or by that of all `together`.

    Raises `InputError` for another shape, for what is not finite, for fewer frequencies than unknowns."""
    f, H = np.asarray(frequencies, float), np.asarray(receptance)
    if H.ndim != 3 or H.shape[0] != len(f) or H.shape[1] != H.shape[2]:
        raise InputError(
            f"{place}: receptance must have the shape ({len(f)}, k, k), but has {H.shape}"
        )
    if H.dtype.kind not in "iufc" or not np.all(np.isfinite(H)):
        raise InputError(f"{place}: receptance must be finite numbers")
    if axes not in (2, 3, 6) or H.shape[1] % axes:
        raise InputError(f"{place}: axes must be 2, 3 or 6 and part the {H.shape[1]} coordinates")
    fewest = 7 if order is None else order
    if len(f) < fewest:
        told = "a search for poles needs" if order is None else f"{order} poles need"
        raise InputError(f"{place}: {told} {fewest} frequencies, but {len(f)} are given")
    if not np.any(H):
        raise InputError(f"{place}: receptance is zero throughout")
    flat = np.moveaxis(H, 0, -1).reshape(-1, len(f)).astype(complex)
    size = np.abs(flat)
    weights = np.ones_like(size) / size.max()
    if relative and together:
        size = np.broadcast_to(np.linalg.norm(size, axis=0), size.shape)
    if relative:
        weights = 1.0 / np.maximum(size, 1e-9 * size.max())
    return Measured(2j * np.pi * f, flat, weights)
