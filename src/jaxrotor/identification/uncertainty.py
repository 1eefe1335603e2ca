"""How well the data know the parameters: covariance, intervals, blind directions, whiteness.

Source: Seber & Wild, Nonlinear Regression (1989), sec. 2.1 and 5.1; Ljung & Box, Biometrika 65 (1978) 297.
"""

import dataclasses

import numpy as np
import scipy.stats

# Singular values (of columns scaled to one length) below this part of the largest: nothing is seen there.
BLIND = 1e-7
# A whole step of a parameter that moves the signals by less than this of their standard deviation.
UNFELT = 1e-8
# Entries of a blind direction smaller than this do not belong to it.
_SHARE = 0.1


@dataclasses.dataclass(frozen=True)
class Knowledge:
    """In the search's own coordinates `u`.

    - `covariance`: (n, n); infinite variance on what takes part in a blind direction.
    - `singular_values`: (n,), falling, of the slopes with columns scaled to length one.
    - `blind`: directions that the data cannot see, each a combination {parameter: share}.
    - `degrees`: degrees of freedom; `scale`: of the standard deviations, 1 where those were given.
    """

    covariance: np.ndarray
    singular_values: np.ndarray
    blind: tuple[dict[str, float], ...]
    degrees: int
    scale: float

    @property
    def std(self) -> np.ndarray:
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        s = self.std
        with np.errstate(invalid="ignore"):
            found = self.covariance / np.outer(s, s)
        np.fill_diagonal(found, 1.0)
        return found

    def quantile(self, level: float) -> float:
        """Half the width of a confidence interval, in standard deviations."""
        return float(scipy.stats.t.ppf(0.5 + 0.5 * level, self.degrees))

    def reach(self, level: float) -> np.ndarray:
        """Half the width of the confidence interval of each u."""
        return self.quantile(level) * self.std


def knowledge(
    J: np.ndarray,
    r: np.ndarray,
    names: tuple[str, ...],
    count: int,
    given: bool,
    spread: np.ndarray | None = None,
) -> Knowledge:
    """`J` (m, n) and `r` (m,): slopes and residuals in standard deviations, of which `count` are independent
    values. `given`: whether the standard deviations were, or are to be taken from the residuals. `spread`:
    (m,), the variance of each residual, where it is known to be another."""
    n = len(names)
    lengths = np.linalg.norm(J, axis=0)
    felt = lengths > UNFELT
    # a parameter that nothing depends on is blind by itself; the rest may be so together
    columns = np.flatnonzero(felt)
    U, s, V = np.linalg.svd(J[:, columns] / lengths[columns], full_matrices=False)
    seen = s > BLIND * (s[0] if s.size else 0.0)
    degrees = max(1, count - n)
    scale = 1.0 if given else float(np.sqrt(r @ r / degrees))
    root = np.where(seen, 1.0 / np.where(seen, s, 1.0), 0.0)
    covariance = np.zeros((n, n))
    if spread is None:
        inner = scale**2 * (V.T * root**2) @ V
    else:
        inverse = (V.T * root) @ U.T
        inner = (inverse * spread) @ inverse.T
        # of twice the growth of the cost, as if the spread were one for all
        scale = float(np.sqrt(np.mean(spread)))
    covariance[np.ix_(columns, columns)] = inner / np.outer(lengths[columns], lengths[columns])
    blind = [{names[i]: 1.0} for i in np.flatnonzero(~felt)]
    lost = set(np.flatnonzero(~felt))
    for direction in V[~seen]:
        shares = direction / lengths[columns]
        # among equals the first, whatever rounding makes of them
        size = np.abs(shares)
        shares = shares / shares[np.argmax(size > (1 - 1e-6) * size.max())]
        taking = np.flatnonzero(np.abs(shares) > _SHARE)
        blind.append({names[columns[i]]: float(shares[i]) for i in taking})
        lost |= {int(columns[i]) for i in taking}
    for i in lost:
        covariance[i, :] = covariance[:, i] = 0.0
        covariance[i, i] = np.inf
    return Knowledge(covariance, np.append(s, np.zeros(n - s.size)), tuple(blind), degrees, scale)


def whiteness(residual: np.ndarray, valid: np.ndarray, lags: int = 20) -> float:
    """Probability that white noise is as correlated as this residual, after Ljung and Box. Pairs with a
    missing value are left out."""
    x = np.where(valid, residual - residual[valid].mean(), 0.0)
    n = int(valid.sum())
    lags = min(lags, n // 5)
    power = x @ x / n
    if power == 0 or lags < 1:
        return 1.0
    q = 0.0
    for k in range(1, lags + 1):
        pairs = int(np.sum(valid[k:] & valid[:-k]))
        if pairs > 1:
            correlation = (x[k:] @ x[:-k]) / (pairs * power)
            q += correlation**2 * pairs
    return float(scipy.stats.chi2.sf(q, lags))


def too_large(residual: np.ndarray, degrees: int) -> float:
    """Probability that noise of the given standard deviation leaves residuals as large as these."""
    return float(scipy.stats.chi2.sf(residual @ residual, degrees))
