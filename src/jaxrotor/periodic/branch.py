"""A branch of periodic motions over speed."""

from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Complex, Float

from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from .motion import PeriodicMotion, amplitudes, place_of


@shows(without=("motion",), speed="rad/s")
class SpecialPoint(NamedTuple):
    """Where a branch turns back in speed (`"fold"`) or its stability changes: `"Neimark-Sacker"` (a pair of
    multipliers leaves the unit circle: a second frequency sets in), `"period doubling"` (through -1),
    `"branch point"` (through 1, where the branch does not turn back), `"grazing"` (multipliers jump, where
    a contact begins or ends).

    `speed`: rad/s; `motion`: the one there; `after`: the number of the point of the branch before it.
    """

    kind: str
    speed: float
    after: int
    motion: PeriodicMotion


@shows(
    without=("coefficients", "internal", "multipliers", "motions"), speeds="rad/s", stable_share=""
)
class Branch(eqx.Module):
    """Periodic motions one after the other along the branch, p of them.

    `speeds`: (p,), rad/s, which need not rise. `motions`: all of them in one, each array with p rows.
    `special`: folds and where stability changes, in their order.
    """

    speeds: Float[np.ndarray, " p"]
    motions: PeriodicMotion
    special: tuple[SpecialPoint, ...]

    plot = plot_door()

    def __len__(self) -> int:
        return len(self.speeds)

    @property
    def stable(self) -> np.ndarray:
        """(p,), whether small deviations die away."""
        return np.asarray(self.motions.stable)

    @property
    def stable_share(self) -> float:
        return float(np.mean(self.stable))

    @property
    def multipliers(self) -> Complex[np.ndarray, "p d"]:
        """Floquet multipliers of each, the largest first."""
        return np.asarray(self.motions.multipliers)

    def harmonics(self, place: str) -> Complex[np.ndarray, "p w"]:
        """As of `PeriodicMotion`, for each. Raises `InputError` for a name that the machine does not have."""
        station, coordinate = place_of(place, self.motions.stations)
        return np.asarray(self.motions.coefficients)[:, :, station, coordinate]

    def amplitude(self, place: str) -> Float[np.ndarray, " p"]:
        """Half the distance between the extremes of a coordinate such as `"disc.x"`, m or rad. Raises
        `InputError` for a name that the machine does not have."""
        return amplitudes(self.harmonics(place), self.motions.orders, self.motions.turns)

    @takes(index=None)
    def motion(self, index: int) -> PeriodicMotion:
        """The motion at a point, by its number from 0 (or -1 for the last). Raises `InputError` for a
        number that there is not."""
        count = len(self)
        if isinstance(index, bool) or not isinstance(index, (int, np.integer)):
            raise InputError(f"index must be a whole number, but is {index!r}")
        if not -count <= index < count:
            raise InputError(f"index must be from {-count} to {count - 1}, but is {index}")
        return jax.tree.map(lambda x: x[index], self.motions)
