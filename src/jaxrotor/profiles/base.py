"""What the ground under a machine does, whatever moves it."""

import abc

from jaxtyping import Array, Float

from ..core.part import Part
from .motion import Scalar

Vec6 = Float[Array, "6"]

# rad: turns are of first order. What is left out is the weight's part along a floor that leans, and forces
# that lean with it: this part of them.
LARGEST_TURN = 0.02


class AbstractBase(Part):
    """A rigid ground that moves: x, y, z (m) of its origin and small turns psi, theta, phi (rad) about it."""

    @abc.abstractmethod
    def at(self, t: Scalar) -> tuple[Vec6, Vec6, Vec6]:
        """Coordinates, rates and accelerations at the time t (s)."""

    @abc.abstractmethod
    def jumps(self) -> Float[Array, " n"]:
        """Instants at which an acceleration jumps or kinks, s."""

    @abc.abstractmethod
    def prepared(self) -> "AbstractBase":
        """What stands for it during a run."""


class Released(AbstractBase):
    """Another ground as seen by who went along with it until `when` (s), `since` then: whatever time it is
    asked for, where that has come from a uniform motion. A short look into a run begins so, at rest."""

    base: AbstractBase
    when: Scalar
    since: Scalar

    def at(self, t: Scalar) -> tuple[Vec6, Vec6, Vec6]:
        place, speed, acceleration = self.base.at(self.when + self.since)
        first, rate, _ = self.base.at(self.when)
        return place - first - self.since * rate, speed - rate, acceleration

    def jumps(self) -> Float[Array, " n"]:
        return self.base.jumps()

    def prepared(self) -> "Released":
        return self
