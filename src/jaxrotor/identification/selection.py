"""Which candidates tell most: one after the other, then exchanged. Nothing is known here of what they are.

Sources: Pukelsheim, Optimal Design of Experiments (2006), ch. 6; Fedorov, Theory of Optimal Experiments
(1972), sec. 3.3 (exchange).
"""

import dataclasses
from typing import Literal

import numpy as np
import scipy.linalg

from .uncertainty import BLIND, UNFELT

Kind = Literal["D", "A", "E"]
# So much of the information of all candidates is always added, so that what a set does not see at all is
# merely known 1e6 times worse: among sets that see too little, those that see more come first.
_RIDGE = 1e-12
# An information below this part of that of all candidates is none.
_NONE = 1e-11
# What takes part in a blind direction by less than this does not.
_BARELY = 1e-6
# Below this part of their size, numbers are those of rounding. Among equals the first is taken.
_SAME = 1e-9


@dataclasses.dataclass(frozen=True)
class Judge:
    """Information of `base`, which is always there, and of the candidates, (c, r, r), in coordinates in which
    all of it together is the unit matrix; `rows` (p, r): what is of interest in terms of these."""

    base: np.ndarray
    each: np.ndarray
    rows: np.ndarray
    kind: Kind

    def spreads(self, information: np.ndarray) -> np.ndarray:
        """Of (..., r, r): "D" the geometric mean of the standard deviations along the principal axes, "A"
        their root mean square, "E" the largest."""
        r = information.shape[-1]
        inverse = np.linalg.inv(information + _RIDGE * np.eye(r))
        covariance = self.rows @ inverse @ self.rows.T
        p = len(self.rows)
        if self.kind == "D":
            return np.exp(np.linalg.slogdet(covariance)[1] / (2 * p))
        if self.kind == "A":
            return np.sqrt(np.trace(covariance, axis1=-2, axis2=-1) / p)
        return np.sqrt(np.linalg.eigvalsh(covariance)[..., -1])

    def spread(self, chosen: list[int]) -> float:
        """Of a set; infinite where it does not see all that is of interest."""
        information = self.information(chosen)
        size, axes = np.linalg.eigh(information)
        unseen = self.rows @ axes[:, size < _NONE]
        if unseen.size and np.abs(unseen).max() > _BARELY * np.abs(self.rows).max():
            return np.inf
        return float(self.spreads(information))

    def information(self, chosen: list[int]) -> np.ndarray:
        return self.base + self.each[chosen].sum(axis=0)

    def added(self, chosen: list[int]) -> list[int]:
        """`chosen`, and after them all the rest: each the one that helps most where it is added."""
        order = list(chosen)
        information = self.information(order)
        while len(order) < len(self.each):
            rest = [c for c in range(len(self.each)) if c not in order]
            spreads = self.spreads(information + self.each[rest])
            order.append(rest[_first_least(spreads)])
            information = information + self.each[order[-1]]
        return order

    def best(self, count: int) -> list[int]:
        """So many candidates, such that no exchange of one makes them better; in the order in which they help
        most."""
        chosen = self.added([])[:count]
        while True:
            rest = [c for c in range(len(self.each)) if c not in chosen]
            if not rest:
                break
            information = self.information(chosen)
            now = float(self.spreads(information))
            swapped = information - self.each[chosen][:, None] + self.each[rest][None]
            spreads = self.spreads(swapped)
            k = _first_least(spreads.ravel())
            if not spreads.ravel()[k] < now * (1 - _SAME):
                break
            out, new = np.unravel_index(k, spreads.shape)
            chosen[out] = rest[new]
        own = dataclasses.replace(self, each=self.each[chosen])
        return [chosen[i] for i in own.added([])]


def _first_least(values: np.ndarray) -> int:
    return int(np.argmax(values <= values.min() * (1 + _SAME)))


def judge_of(
    base: np.ndarray, slopes: list[np.ndarray], interest: np.ndarray, kind: Kind
) -> Judge | None:
    """`base` (k, n) and each candidate's `slopes` (k, n): rows of which the information is their product with
    themselves. `interest`: (p, n), combinations of the n that matter. Of these, what all candidates
    together do not see is left out; `None` where that is all."""
    n = base.shape[1]
    J = np.vstack([base, *slopes, np.zeros((n, n))])
    lengths = np.linalg.norm(J, axis=0)
    felt = lengths > UNFELT
    if not felt.any():
        return None
    _, s, V = np.linalg.svd(J[:, felt] / lengths[felt], full_matrices=False)
    seen = s > BLIND * s[0]
    axes = np.zeros((n, n))
    axes[felt, : felt.sum()] = (V / lengths[felt]).T
    axes[~felt, felt.sum() :] = np.eye((~felt).sum())
    r = int(seen.sum())
    blind = interest @ axes[:, r:] / np.linalg.norm(axes[:, r:], axis=0) / np.abs(interest).max()
    blind[np.abs(blind) < _BARELY] = 0.0
    kept = scipy.linalg.null_space(blind.T, rcond=_BARELY).T
    if not len(kept):
        return None
    whole = axes[:, :r] / s[:r]  # slopes @ whole: of all candidates together, orthonormal
    grams = [(j @ whole).T @ (j @ whole) for j in (base, *slopes)]
    return Judge(grams[0], np.array(grams[1:]), kept @ interest @ whole, kind)
