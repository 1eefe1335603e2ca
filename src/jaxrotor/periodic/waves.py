"""The waves of which a periodic motion is made, over the angle of the shaft."""

from typing import NamedTuple

import numpy as np


class Waves(NamedTuple):
    """A motion that repeats after `turns` turns, with orders up to `harmonics` per turn.

    Its rows of coefficients, 2 K + 1 with K = harmonics * turns: the mean, then cosine and sine of each order
    k / turns. It is looked at in `samples` instants, equally far apart.
    """

    harmonics: int
    turns: int
    samples: int

    @property
    def count(self) -> int:
        return 2 * self.harmonics * self.turns + 1

    @property
    def orders(self) -> np.ndarray:
        """(K + 1,), per turn of the shaft."""
        return np.arange(self.harmonics * self.turns + 1) / self.turns

    @property
    def angles(self) -> np.ndarray:
        """(samples,), rad, of the shaft."""
        return 2 * np.pi * self.turns * np.arange(self.samples) / self.samples

    def at(self, angles: np.ndarray) -> np.ndarray:
        """(angles, 2 K + 1): what the coefficients count for at these angles."""
        phases = angles[:, None] * self.orders[1:]
        both = np.stack([np.cos(phases), np.sin(phases)], axis=-1).reshape(len(angles), -1)
        return np.concatenate([np.ones((len(angles), 1)), both], axis=1)

    @property
    def derivative(self) -> np.ndarray:
        """(2 K + 1, 2 K + 1): coefficients of the derivative by the angle."""
        found = np.zeros((self.count, self.count))
        for k, order in enumerate(self.orders[1:]):
            cosine, sine = 2 * k + 1, 2 * k + 2
            found[cosine, sine], found[sine, cosine] = order, -order
        return found

    @property
    def from_samples(self) -> np.ndarray:
        """(2 K + 1, samples): the coefficients nearest to what was sampled."""
        weight = np.full(self.count, 2.0)
        weight[0] = 1.0
        return weight[:, None] * self.at(self.angles).T / self.samples
