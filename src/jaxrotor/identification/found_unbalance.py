"""An unknown unbalance, as far as vectors tell it."""

import dataclasses
from typing import Any

import numpy as np
import scipy.stats
from jaxtyping import Complex, Float

from ..core.result_text import shows


@shows(unbalance="@unit", std="@unit")
@dataclasses.dataclass(frozen=True)
class FoundUnbalance:
    """`unbalance`: (p,) complex, one for each plane, in `unit`. `covariance`: (p, p) complex, Hermitian;
    `std`: (p,), of the real and of the imaginary part each. `chance`: the probability that vectors lie as far
    as the measured ones from all that an unbalance in these planes could make: a small one says that
    something else is the matter. `degrees`: of freedom, for intervals."""

    unbalance: Complex[np.ndarray, " p"]
    covariance: Complex[np.ndarray, "p p"]
    chance: float
    degrees: float
    unit: str = ""

    @property
    def std(self) -> Float[np.ndarray, " p"]:
        return np.sqrt(np.real(np.diag(self.covariance)) / 2)

    def intervals(self, level: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
        """Half widths (p,) of the confidence intervals of size (in `unit`) and angle (rad; pi where the size
        may be nothing), each by itself."""
        reach = scipy.stats.t.ppf(0.5 + 0.5 * level, self.degrees) * self.std
        size = np.abs(self.unbalance)
        with np.errstate(divide="ignore"):
            angle = np.where(reach < size, np.arcsin(np.minimum(1.0, reach / size)), np.pi)
        return reach, angle

    def disc(self, level: float = 0.95) -> Float[np.ndarray, " p"]:
        """(p,): radius of the disc in which each unbalance lies with this probability, in `unit`."""
        return np.sqrt(2 * scipy.stats.f.ppf(level, 2, self.degrees)) * self.std

    def covers(self, truth: Any, level: float = 0.95) -> np.ndarray:
        """(p,): whether these discs hold `truth`."""
        return np.abs(np.asarray(truth) - self.unbalance) <= self.disc(level)
