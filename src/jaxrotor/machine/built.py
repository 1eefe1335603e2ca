"""What a machine holds, for the files below `Machine` that look into one."""

from typing import Protocol

from jaxtyping import Array, Float

from ..core.protocol import AbstractElement, AbstractStation
from ..profiles.motion import AbstractMotion
from .wiring import Wiring


class Built(Protocol):
    """The fields of `Machine`, read alone."""

    @property
    def stations(self) -> tuple[AbstractStation, ...]: ...

    @property
    def connectors(self) -> tuple[AbstractElement, ...]: ...

    @property
    def motions(self) -> tuple[AbstractMotion, ...]: ...

    @property
    def gravity(self) -> Float[Array, "3"]: ...

    @property
    def wiring(self) -> Wiring: ...

    def filled(self) -> "Built":
        """With the lumped shares of shafts filled in."""
        ...

    def fixed(self) -> dict[str, tuple[str, ...]]:
        """station -> the names of those of its coordinates that stay zero."""
        ...
