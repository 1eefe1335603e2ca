"""Influence coefficients from many trial runs, with what changes from run to run: Bayesian, robust, with
intervals for an unknown unbalance.

Model: y = A u + b + e. e has a covariance S over all measurements together (probes and speeds), for what
drifts between runs moves them together, and the tails of Student's t, whose degrees of freedom are the
likeliest.
b is nothing on the day of the baseline, and one random vector for each other day, of covariance kappa S;
kappa by expectation and maximisation.
Vectors that stand out of a robust regression of their own column are left out first. S comes from the
residuals; where these are fewer than two for each measurement it is drawn towards its diagonal.

Sources: Goodman, Trans. ASME J. Eng. Ind. 86 (1964) 273 (least squares balancing); Maronna, Martin & Yohai,
Robust Statistics (2006), ch. 5 (bisquare regression); Lange, Little & Taylor, J. Am. Stat. Assoc. 84 (1989)
881 (t errors, missing values); Ledoit & Wolf, J. Multivariate Anal. 88 (2004) 365 (shrinkage); Williams,
Biometrika 54 (1967) 305 (weighing by an estimated covariance: what its scatter adds).
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.special
import scipy.stats
from jaxtyping import Bool, Complex, Float

from ..core.arguments import complex_array, number
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from .found_unbalance import FoundUnbalance

# Degrees of freedom of the t distribution that are tried.
_TAILS = (3.0, 4.0, 6.0, 10.0, 20.0, 60.0, 1e6)
_ITERATIONS, _ROBUST, _REST = 200, 40, 1e-7
# A vector stands out so many of its column's robust rms away: one in ten thousand does so by chance. Beside
# it the bisquare's own reach, and the rms of a complex normal number's length over its median.
_APART, _REACH, _RMS = 3.0, 4.0, 1.2011


@shows()
@dataclasses.dataclass(frozen=True)
class Influence:
    """**What trial runs told:**

    - `coefficients`: (m, p) complex, vector per unit of unbalance. `coefficient_std`: (m, p), of their real
      and imaginary parts.
    - `drift`: (m, m) complex covariance of what a run adds of its own; `drift_std`: (m,).
    - `days`: label -> (m,) complex, what the runs of that day share; `unrest`: how many times the drift's
      covariance is that of a day's vector.
    - `left_out`: (n, m), vectors that stand out and count for nothing; `doubted`: the runs of which most do:
      look whether these are labelled rightly.
    - `tail`: degrees of freedom of the t distribution of what a run adds; `degrees`: of freedom left to know
      the covariance by, infinite where it was drawn towards its diagonal.
    """

    coefficients: Complex[np.ndarray, "m p"]
    covariance: Complex[np.ndarray, "mq mq"]
    drift: Complex[np.ndarray, "m m"]
    days: dict[Any, Complex[np.ndarray, " m"]]
    unrest: float
    left_out: Bool[np.ndarray, "n m"]
    tail: float
    degrees: float

    @property
    def coefficient_std(self) -> Float[np.ndarray, "m p"]:
        m, p = self.coefficients.shape
        return np.sqrt(np.real(np.diag(self.covariance)) / 2).reshape(m, -1)[:, :p]

    @property
    def drift_std(self) -> Float[np.ndarray, " m"]:
        return np.sqrt(np.real(np.diag(self.drift)) / 2)

    @property
    def doubted(self) -> tuple[int, ...]:
        return tuple(np.flatnonzero(self.left_out.mean(axis=1) > 0.5).tolist())

    def predicted(self, unbalance: Any, day: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Vectors (m,) that an unbalance (p,) makes on a `day`, and the standard deviation of their real and
        imaginary parts: drift and what is not known of the coefficients."""
        u = self._planes(unbalance)
        vectors = self.coefficients @ u + self.days.get(day, 0.0)
        return vectors, np.sqrt(np.real(np.diag(self._spread(u, day))) / 2)

    @takes(prior=number(above=0.0))
    def unbalance(
        self, vectors: Any, prior: float | None = None, unit: str = "", day: Any = None
    ) -> FoundUnbalance:
        """The unbalance (p,) that made `vectors` (m,; NaN where one is missing), by weighed least squares:
        what drifts together counts together.

        `prior`: standard deviation of the real and imaginary part of each unbalance before anything was
        measured; left out, anything is thought possible. `day`: on which it was measured, as told to
        `influence`; None that of the baseline; one that was not told has a vector that nobody knows.
        Raises `InputError` for fewer vectors than planes.
        """
        y = np.asarray(vectors, complex)
        if y.shape != (len(self.coefficients),):
            raise InputError(
                f"vectors must be {len(self.coefficients)}, one for each measurement, but have shape "
                f"{y.shape}"
            )
        there = np.isfinite(y)
        m, p = int(there.sum()), self.coefficients.shape[1]
        if m < p:
            raise InputError(f"{m} vectors cannot tell {p} unbalances: measure more")
        A, known = self.coefficients[there], np.zeros((p, p))
        if prior is not None:
            known = np.eye(p) / (2 * prior**2)
        y = y - self.days.get(day, 0.0)
        u = np.zeros(p, complex)
        for _ in range(20):  # the scatter grows with what is found
            S = self._spread(u, day)[np.ix_(there, there)]
            W = np.linalg.solve(S, A)
            C = np.linalg.inv(A.conj().T @ W + known)
            before, u = u, C @ (W.conj().T @ y[there])
            if np.abs(u - before).max() <= _REST * max(np.abs(u).max(), 1e-300):
                break
        r = y[there] - A @ u
        size = float((r.conj() @ np.linalg.solve(S, r)).real)
        free = m - p
        # weighed by a covariance that is itself estimated: the stated one is too small, the real one larger
        spare = 1.0 if np.isinf(self.degrees) else self.degrees / max(self.degrees - free, 1.0)
        degrees = 1 / (1 / self.tail + 1 / (2 * max(self.degrees - free, 1.0)))
        # |r|² in units of S: a sum of `free` exponentials, over the scatter's own uncertainty
        chance = scipy.stats.f.sf(size / free / spare, 2 * free, degrees) if free else 1.0
        return FoundUnbalance(u, np.asarray(C * spare**2), float(chance), degrees, unit)

    def _planes(self, unbalance: Any) -> np.ndarray:
        u = complex_array(unbalance, "unbalance")
        if u.size != self.coefficients.shape[1]:
            raise InputError(
                f"unbalance must be {self.coefficients.shape[1]}, one for each plane, but has {u.size}"
            )
        return u

    def _spread(self, u: np.ndarray, day: Any) -> np.ndarray:
        """(m, m): covariance of vectors under an unbalance u."""
        m = len(self.coefficients)
        row = np.concatenate([u, [day == one for one in self.days]])
        spread = np.kron(np.eye(m), row[None])
        own = 1.0 + self.unrest * (day is not None and day not in self.days)
        return own * self.drift + spread @ self.covariance @ spread.conj().T


def influence(
    unbalances: Any,
    vectors: Any,
    prior: tuple[Any, Any] | None = None,
    days: Sequence[Any] | None = None,
) -> Influence:
    """Influence coefficients from runs under known unbalances: any number of them, in one plane or several
    at once, with missing vectors.

    **Arguments:**

    - `unbalances`: (n, p) complex, what was added in each plane, any unit.
    - `vectors`: (n, m) complex, what each run measured less the baseline: a column is one probe at one speed;
      NaN where one is missing.
    - `prior`: (coefficients (m, p), standard deviation (m, p) or one for all, of real and imaginary parts) of
      a model that was fitted to something else, such as `unbalance_response` per unit of unbalance: the runs
      then correct the model as far as they know better.
    - `days`: (n,), a label for each run; None for those of the baseline's own day. What the runs of another
      day share, for the baseline has moved by then, is told apart from their unbalances. (A vector that has
      moved so far that it stands out from all days' counts for nothing, as ever.)

    Raises `InputError` where shapes do not fit, or runs are fewer than planes.
    """
    U = complex_array(unbalances, "unbalances", 2)
    Y = np.asarray(vectors, complex)
    if Y.ndim != 2 or len(Y) != len(U):
        raise InputError(
            f"vectors must be {len(U)} rows, one for each run, but have shape {Y.shape}"
        )
    (n, p), m = U.shape, Y.shape[1]
    there = np.isfinite(Y)
    if n <= p or (there.sum(axis=0) <= p).any():
        raise InputError(
            f"{n} runs cannot tell {p} planes and their scatter: make {p + 1} at least, each measured by "
            "every probe"
        )
    told = [None] * n if days is None else list(days)
    if len(told) != n:
        raise InputError(f"days must be {n}, a label for each run, but are {len(told)}")
    labels = [day for day in dict.fromkeys(told) if day is not None]
    shared = np.array([[day == one for one in labels] for day in told], float).reshape(n, -1)
    mean, precision = _known(prior, m, p, len(labels))
    left_out = _standing_out(U, Y, there)
    Y, there = np.where(left_out, np.nan, Y), there & ~left_out
    some = there.any(axis=1)
    U, Y, there = np.hstack([U, shared])[some], Y[some], there[some]
    alike = _alike(there)
    fits = [(_fitted(U, Y, there, alike, mean, precision, p, tail), tail) for tail in _TAILS]
    (A, covariance, S, unrest, degrees, _), tail = max(fits, key=lambda pair: pair[0][-1])
    vectors = dict(zip(labels, A[:, p:].T))
    return Influence(A[:, :p], covariance, S, vectors, unrest, left_out, tail, degrees)


def _fitted(U, Y, there, alike, mean, precision, planes: int, tail: float) -> tuple:
    """Coefficients (those of the days behind those of the `planes`), their covariance, scatter, how a day's
    vector compares to it, degrees of freedom and the log likelihood."""
    (n, p), m = U.shape, Y.shape[1]
    few, unrest = n - p < 2 * m, 1.0
    daily = np.arange(m)[:, None] * p + np.arange(planes, p)
    A, S, weights = mean, np.eye(m) * np.nanmean(np.abs(Y) ** 2), np.ones(n)
    size, volume, covariance = np.zeros(n), 0.0, np.eye(m * p)
    count = there.sum(axis=1)
    for _ in range(_ITERATIONS):
        before = A
        H = np.diag(precision).astype(complex)
        if planes < p:
            apart = np.linalg.inv(S) / unrest
            for own in daily.T:
                H[np.ix_(own, own)] += apart
        A, covariance, filled, spare = _regressed(
            U, Y, alike, S, weights, H, precision * mean.ravel()
        )
        if planes < p:
            left = sum(
                covariance[np.ix_(own, own)] + np.outer(b, b.conj())
                for own, b in zip(daily.T, A[:, planes:].T)
            )
            unrest = float(np.trace(np.linalg.solve(S, left)).real) / daily.size
        R = filled - U @ A.T
        S = _scatter(R, weights, spare, max(n - p, 1), few)
        size, volume = _distances(R, alike, S)
        weights = (tail + 2 * count) / (tail + 2 * size)
        if np.abs(A - before).max() <= _REST * np.abs(A).max():
            break
    gamma, half = scipy.special.gammaln, tail / 2
    each = (
        gamma(half + count)
        - gamma(half)
        - count * np.log(half)
        - (half + count) * np.log1p(size / half)
    )
    return A, covariance, S, unrest, np.inf if few else float(n - p), float(each.sum() - volume)


def _standing_out(U: np.ndarray, Y: np.ndarray, there: np.ndarray) -> np.ndarray:
    """(n, m): vectors far from a robust regression of their column: least lengths, then the bisquare."""
    found = np.zeros(Y.shape, bool)
    for column, known in enumerate(there.T):
        u, y = U[known], Y[known, column]
        w = np.ones(len(y))
        for turn in range(2 * _ROBUST):
            root = np.sqrt(w)
            a = np.linalg.lstsq(u * root[:, None], y * root, rcond=None)[0]
            away = np.abs(y - u @ a)
            rms = max(_RMS * float(np.median(away)), 1e-300)
            if turn < _ROBUST:
                w = 1 / np.maximum(away / rms, 0.1)
            else:
                w = np.where(away < _REACH * rms, (1 - (away / (_REACH * rms)) ** 2) ** 2, 0.0)
        if (w > 0).sum() > U.shape[1]:
            found[np.flatnonzero(known), column] = away >= _APART * rms
    return found


def _known(prior: Any, m: int, p: int, days: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean (m, q) and precision (m q,) of the coefficients beforehand, nothing of so many `days` behind the
    p planes."""
    if prior is None:
        return np.zeros((m, p + days), complex), np.zeros(m * (p + days))
    mean = complex_array(prior[0], "prior: coefficients", 2)
    if mean.shape != (m, p):
        raise InputError(f"prior: coefficients must be {m} by {p}, but have shape {mean.shape}")
    std = np.broadcast_to(np.asarray(prior[1], float), (m, p))
    if not (np.isfinite(std).all() and (std > 0).all()):
        raise InputError("prior: standard deviations must be positive and finite")
    behind = ((0, 0), (0, days))
    return np.pad(mean, behind), np.pad(1 / (2 * std**2), behind).ravel()


def _regressed(U, Y, alike, S, weights, H, g) -> tuple:
    """Coefficients (m, p), their covariance (m p, m p), vectors with the missing ones as they are expected,
    and what these leave uncertain (m, m) in the sum of squares. `H`, `g`: what was known before."""
    p, m = U.shape[1], Y.shape[1]
    which, patterns = alike
    W, there = _weights(S, patterns), patterns[which]
    known = np.where(there, Y, 0.0)
    of = (which == np.arange(len(patterns))[:, None]) * weights
    H = H.reshape(m, p, m, p)
    for own, share in zip(W, of):
        H = H + own[:, None, :, None] * ((share[:, None] * U.conj()).T @ U)[:, None]
    pull = np.einsum("nij,nj->ni", W[which], known) * weights[:, None]
    covariance = np.linalg.inv(H.reshape(m * p, m * p))
    A = (covariance @ (g + (pull.T @ U.conj()).ravel())).reshape(m, p)
    if patterns.all():
        return A, covariance, Y.copy(), np.zeros((m, m), complex)
    gain, expected = S @ W, U @ A.T  # of what is there, upon what is missing
    rest = np.einsum("nij,nj->ni", gain[which], np.where(there, Y - expected, 0.0))
    left = np.where(~patterns[:, :, None] & ~patterns[:, None], S - gain @ S, 0.0)
    spare = np.tensordot(of.sum(axis=1), left, 1)
    return A, covariance, np.where(there, Y, expected + rest), spare


def _distances(R, alike, S) -> tuple[np.ndarray, float]:
    """(n,): r^H S^-1 r of each run, as far as its vectors are there; and the sum of their log det S."""
    which, patterns = alike
    r = np.where(patterns[which], R, 0.0)
    size = np.real(np.einsum("ni,nij,nj->n", r.conj(), _weights(S, patterns)[which], r))
    return size, float(np.linalg.slogdet(_known_part(S, patterns))[1][which].sum())


def _known_part(S: np.ndarray, patterns: np.ndarray) -> np.ndarray:
    """For each pattern S of the vectors that are there, and the identity of those that are missing."""
    both = patterns[:, :, None] & patterns[:, None]
    return np.where(both, S, np.eye(len(S)))


def _weights(S: np.ndarray, patterns: np.ndarray) -> np.ndarray:
    """Its inverse, nothing of those that are missing."""
    both = patterns[:, :, None] & patterns[:, None]
    return np.where(both, np.linalg.inv(_known_part(S, patterns)), 0.0)


def _alike(there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Runs that lack the same vectors: of each run its pattern's number, and of each pattern which are
    there."""
    patterns, which = np.unique(there, axis=0, return_inverse=True)
    return which.ravel(), patterns


def _scatter(R: np.ndarray, weights: np.ndarray, spare: np.ndarray, degrees: int, few: bool):
    """Covariance of the rows of R (n, m); of `few`, drawn towards its diagonal as far as chance moves it."""
    n = len(R)
    full = (np.einsum("n,ni,nj->ij", weights, R, R.conj()) + spare) / degrees
    share = 0.0
    target = np.diag(np.real(np.diag(full))).astype(complex)
    if few:
        away = (np.abs(full - target) ** 2).sum()
        each = [w * np.outer(r, r.conj()) - full * degrees / n for r, w in zip(R, weights)]
        chance = (np.abs(each) ** 2).sum(axis=0)[~np.eye(len(full), dtype=bool)].sum()
        share = min(1.0, chance / degrees**2 / away) if away > 0 else 1.0
    S = (1 - share) * full + share * target
    return S + 1e-9 * np.real(np.trace(S)) / len(S) * np.eye(len(S))
