"""A foundation's modes from its measured frequency responses."""

from typing import Any

import equinox as eqx
import numpy as np

from ..core.arguments import numbers
from ..core.gate import takes
from ..core.result_text import shows
from ..core.threads import one_thread
from ..elements.bearings.modal_foundation import ModalFoundation
from .measured_response import Measured, fit_arguments, measured
from .partial_fractions import Rational

# Sweeps over the modes; what they move by, as part of the largest, when they end.
_SWEEPS, _SETTLED = 2000, 1e-13
# Eigenvalues of a mode's matrix below so many times what noise alone makes are noise; of exact data, below
# this part of the largest.
_NOISE, _RANK = 1.5, 1e-9


@shows(frequencies="Hz")
class FittedModes(eqx.Module):
    """A receptance `sum shape shape' / (w² + 2 zeta w s + s²)`, fitted: modes scaled to mass.

    - `frequencies`: (m,), Hz, undamped; several modes share one where they move in one another's directions.
    - `damping_ratios`: (m,). - `shapes`: (n, axes, m), of each point in each mode, 1/sqrt(kg) (1/sqrt(kg m²)
    for tilts). - `error`: root mean square of what is left, as part of that of the response, weighted as the
    fit was. Those above the measured range stand for what all modes there yield.
    """

    frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    error: float

    @takes(frequencies=numbers("Hz"))
    def at(self, frequencies: Any) -> np.ndarray:
        """The fit at frequencies (n,) in Hz: (n, k, k), m/N. Raises `InputError` for what is no number."""
        f = np.atleast_1d(np.asarray(frequencies, float))[:, None]
        g = (self.frequencies**2 - f**2 + 2j * self.damping_ratios * self.frequencies * f) * (
            2 * np.pi
        ) ** 2
        shapes = self.shapes.reshape(-1, len(self.frequencies))
        return np.einsum("im,jm,fm->fij", shapes, shapes, 1.0 / g)

    def foundation(self, stiffness: Any, damping: Any = (0.0,) * 6) -> ModalFoundation:
        """With mounts of this stiffness and damping (SI): six numbers, or a row of six for each point."""
        shapes = self.shapes
        if shapes.shape[1] == 2:
            shapes = np.pad(shapes, ((0, 0), (0, 1), (0, 0)))
        return ModalFoundation(
            self.frequencies, self.damping_ratios, shapes, stiffness, damping  # pyright: ignore
        )  # fmt: skip


@fit_arguments
@one_thread
def fit_modes(
    frequencies: Any,
    receptance: Any,
    order: int | None = None,
    axes: int = 3,
    relative: bool = False,
    beyond: bool = True,
) -> FittedModes:
    """Real modes through a measured receptance, by the poles that `fit_receptance` finds. What comes out is
    symmetric and passive whatever the noise, and its energy is known.

    Arguments as of `fit_receptance`; `relative`: every frequency counts by the size of what is measured
    there. Each pole's matrix `shape shape'` is the symmetric one without
    negative eigenvalues that leaves least; eigenvalues that noise alone could make are left out. A
    foundation with strong local dampers, whose shapes are complex, leaves more: `error` tells, and a warning
    above a tenth.

    Raises `InputError` for another shape, for what is not finite, for fewer frequencies than unknowns.
    """
    place = "fit_modes"
    given = measured(place, frequencies, receptance, order, axes, relative, together=True)
    poles = given.poles(order, beyond)
    upper = poles[np.imag(poles) > 0]
    matrices, noise = _matrices(given, upper)
    w, zeta = np.abs(upper), -np.real(upper) / np.abs(upper)
    modes = []
    for at, ratio, matrix, spread in zip(w, zeta, matrices, noise):
        sizes, shapes = np.linalg.eigh(matrix)
        least = max(_RANK * sizes[-1], _NOISE * spread)
        modes += [(at, ratio, np.sqrt(x) * v) for x, v in zip(sizes, shapes.T) if x > least]
    at, ratios = (np.array([m[i] for m in modes]) for i in (0, 1))
    shapes = np.array([m[2] for m in modes]).T
    damped = at * (-ratios + 1j * np.sqrt(1 - ratios**2))
    residues = np.einsum("im,jm,m->ijm", shapes, shapes, 1.0 / (2j * damped.imag))
    residues = residues.reshape(-1, len(at))
    found = Rational(
        np.concatenate([damped, damped.conj()]), np.concatenate([residues, residues.conj()], axis=1)
    )
    error = given.error(place, found)
    return FittedModes(at / (2 * np.pi), ratios, shapes.reshape(-1, axes, len(at)), error)


def _matrices(given: Measured, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each pole (m,): the symmetric matrix (k, k) without negative eigenvalues, all together leaving the
    least sum of squares; and the largest eigenvalue that noise makes of none.

    One matrix after another by the others, until none moves: the sum is convex, and each step takes it to the
    least that one matrix can bring."""
    k, m = int(np.sqrt(len(given.responses))), len(upper)
    H = (given.weights * given.responses).reshape(k, k, -1)
    g = given.weights[:1].T / ((given.s[:, None] - upper) * (given.s[:, None] - upper.conj()))
    size = np.linalg.norm(g, axis=0)
    g = g / size
    G = np.real(g.conj().T @ g)
    P = np.real(np.einsum("fm,ijf->mij", g.conj(), H))
    P = 0.5 * (P + np.swapaxes(P, 1, 2))
    W = np.zeros((m, k, k))
    for _ in range(_SWEEPS):
        most = 0.0
        for i in range(m):
            values, vectors = np.linalg.eigh(P[i] - np.tensordot(G[i], W, 1) + W[i])
            new = (vectors * np.maximum(values, 0.0)) @ vectors.T
            most = max(most, np.abs(new - W[i]).max())
            W[i] = new
        if most <= _SETTLED * np.abs(W).max():
            break
    left = np.sum(np.abs(np.einsum("fm,mij->ijf", g, W) - H) ** 2)
    # a symmetric matrix of noise: the edge of Wigner's semicircle
    spread = np.sqrt(2 * k * left / (2 * H.size) * np.diag(np.linalg.pinv(G)))
    return W / size[:, None, None], spread / size
