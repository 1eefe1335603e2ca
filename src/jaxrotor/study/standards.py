"""The [standards] section of a study: what `jaxrotor assess` holds the machine against."""

from dataclasses import dataclass, field
from typing import Any, Literal

from ..standards.placed import Probe

Zone = Literal["A", "B", "C"]


@dataclass(frozen=True)
class Limits:
    """Instead of the standard's; its own by default. `most_below`, `most_above`: %, `probe`: m pp."""

    most_below: float = 16.0
    most_above: float = 26.0
    least_factor: float = 2.5
    probe: float | None = None
    share: float = 0.75
    scale: float = 6.0


@dataclass(frozen=True)
class Stability:
    """`stations` -> share of the cross coupling. `anticipated`: Q_A, N/m."""

    stations: dict[str, float]
    anticipated: float
    density: float | None = None
    without: tuple[str, ...] = ()
    level_two: bool = True
    turbine: bool = False
    least_ratio: float = 2.0
    least_decrement: float = 0.1
    screened_ratio: float = 10.0


@dataclass(frozen=True)
class Balance:
    """`speed`: rad/s of service. `planes`: two stations. `residual`: kg·m in them, or of the whole; `None`:
    what the machine's rotors have."""

    grade: float
    speed: float
    planes: tuple[str, str] | None = None
    residual: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Vibration:
    """`place`: a station of the shaft, or a housing's coordinate; `value`: m pp or m/s RMS that was measured,
    or `None`: computed at the greatest speed."""

    kind: Literal["shaft", "housing"]
    place: str
    value: float | None = None
    accepted: Zone = "B"
    group: Literal["1", "2"] = "1"
    support: Literal["rigid", "flexible"] = "rigid"
    limits: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Loop:
    """A control loop, as `jr.standards.loop_sensitivity` takes it; `speed`: rad/s."""

    name: str
    speed: float
    accepted: Zone = "A"
    signal: str | None = None
    acts_on: str | None = None
    against: str | None = None
    limits: tuple[float, ...] = (3.0, 4.0, 5.0)


@dataclass(frozen=True)
class Standards:
    """What [standards] asks for, SI. `speeds`: least and greatest of service. `unbalance`: station -> (kg·m,
    rad), or `None`: by mode shape. `clearances`: station -> diametral, m. `films`: bearing -> (least,
    greatest) radial clearance, m."""

    speeds: tuple[float, float]
    probes: tuple[Probe, ...] = ()
    unbalance: dict[str, tuple[float, float]] | None = None
    bearings: tuple[str, ...] | None = None
    modes: int = 2
    trip: float | None = None
    clearances: dict[str, float] = field(default_factory=dict)
    films: dict[str, tuple[float, float]] = field(default_factory=dict)
    state: Literal["equilibrium", "undeformed"] = "equilibrium"
    limits: Limits = Limits()
    stability: Stability | None = None
    balance: Balance | None = None
    vibration: tuple[Vibration, ...] = ()
    magnetic: tuple[Loop, ...] = ()

    @property
    def greatest(self) -> float:
        return self.speeds[1]


def probe_text(probe: Any) -> str:
    """As it stands in a study."""
    return (
        probe if isinstance(probe, str) else f"{probe[0]} at {probe[1] * 57.29577951308232:.6g} deg"
    )
