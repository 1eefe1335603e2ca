"""How many poles a measured receptance has: as many as pay for themselves."""

import numpy as np

from .partial_fractions import distinct, fitted, stacked
from .pole_polish import polished
from .vector_fitting import pairs_at, starting_poles, vector_fit

# Poles beyond the measured range, as parts of its end, 2 % damped: what modes there yield statically, and
# how that rises towards their resonance.
_BEYOND, _RATIO = np.array([1.5, 4.0]), 0.02
# What is left of exact responses, as part of them, is rounding.
_ROUNDING = 1e-11
# Pairs that bring nothing, one after another, before the search ends; pairs at most.
_PATIENCE, _MOST = 2, 40
# Rounds of vector fitting, and gain of a polishing step, that a search is content with.
_ROUNDS, _GAIN = 10, 1e-6
# Responses that a search looks at, at most: mixtures of all, the strongest ones.
_LOOKED_AT = 12


class PoleSearch:
    """Poles through responses (h, n) at s (n,) on the imaginary axis with `weights` alike."""

    def __init__(self, s: np.ndarray, responses: np.ndarray, weights: np.ndarray):
        self.given = s, responses, weights
        self.few = s, *_strongest(responses, weights)
        at = _BEYOND * np.imag(s).max()
        upper = at * (-_RATIO + 1j * np.sqrt(1 - _RATIO**2))
        self.far = np.stack([upper, upper.conj()], axis=1).ravel()
        self.size = float(np.sum(np.abs(weights * responses) ** 2))

    def of(self, count: int, beyond: bool) -> np.ndarray:
        """So many, and those beyond the range."""
        far = self.far if beyond else self.far[:0]
        start = starting_poles(np.imag(self.given[0]), count)
        return self._last(vector_fit(*self.given, start, far), far)

    def chosen(self) -> np.ndarray:
        """As many as lower Schwarz's criterion (Ann. Statist. 6 (1978) 461), `N ln(sum of squares) +
        k ln N` of N numbers and k unknowns, with poles beyond the range or without."""
        s, found, idle = np.imag(self.given[0]), np.zeros(0, complex), 0
        best, least = found, np.inf
        for pairs in range(1, min(_MOST, (len(s) - len(self.far)) // 2) + 1):
            peak = s[np.argmax(self._left(np.concatenate([found, self.far])))]
            starts = np.concatenate([found, pairs_at(peak)]), starting_poles(s, 2 * pairs)
            found = min((self._moved(x, self.far) for x in starts), key=self._price)
            found = found[: 2 * pairs]
            price = self._price(np.concatenate([found, self.far]))
            if price < least:
                best, least, idle = found, price, 0
            else:
                idle += 1
            if idle == _PATIENCE:
                break
        both = (self._moved(best, far) for far in (self.far, self.far[:0]))
        near = min(both, key=self._price)
        return self._last(near[: len(best)], near[len(best) :])

    def _left(self, poles: np.ndarray) -> np.ndarray:
        """(n,): the sum of squares at each s that the best residues leave."""
        s, responses, weights = self.few
        rest = fitted(*self.few, poles).at(s) - responses
        return np.sum(np.abs(weights * rest) ** 2, axis=0)

    def _price(self, poles: np.ndarray) -> float:
        """Schwarz's criterion."""
        _, responses, _ = self.few
        numbers = 2 * responses.size
        free = len(poles) - np.sum(np.isin(poles, self.far))
        unknown = free + len(responses) * (len(poles) - 1)
        left = max(float(np.sum(self._left(poles))), _ROUNDING**2 * self.size)
        return numbers * np.log(left) + unknown * np.log(numbers)

    def _moved(self, start: np.ndarray, far: np.ndarray) -> np.ndarray:
        near = vector_fit(*self.few, start, far, _ROUNDS)
        return np.concatenate([polished(*self.few, near, far, _GAIN), far])

    def _last(self, near: np.ndarray, far: np.ndarray) -> np.ndarray:
        return np.concatenate([polished(*self.given, near, far), far])


def _strongest(responses: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where all have the same weights, mixtures at right angles say the same as the responses, and the weak
    ones are noise."""
    if len(responses) <= _LOOKED_AT or len(distinct(weights)) > 1:
        return responses, weights
    real = stacked(weights * responses, 1)
    mixed = np.linalg.svd(real, full_matrices=False)[0][:, :_LOOKED_AT].T @ real
    half = mixed.shape[1] // 2
    return (mixed[:, :half] + 1j * mixed[:, half:]) / weights[:1], weights[:_LOOKED_AT]
