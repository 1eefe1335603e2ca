"""Zones of shaft and housing vibration in service."""

from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, numbers
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from .finding import Assessment, Finding

SHAFT = "ISO 7919-3 / ISO 20816-3, shaft vibration (formula as commonly restated, text not seen)"
HOUSING = "ISO 10816-3 / ISO 20816-3, housings (values as commonly restated, text not seen)"
_LIMITS = numbers(above=0.0, size=3, rising=True)
_LETTERS = "ABCD"

# mm/s, RMS: ends of zones A, B and C. Group 1: above 300 kW (electrical machines from 315 mm shaft height
# on); group 2: 15 to 300 kW (160 to 315 mm).
_VELOCITIES = {
    ("1", "rigid"): (2.3, 4.5, 7.1),
    ("1", "flexible"): (3.5, 7.1, 11.0),
    ("2", "rigid"): (1.4, 2.8, 4.5),
    ("2", "flexible"): (2.3, 4.5, 7.1),
}


def zone_of(value: Any, limits: Any) -> str:
    """ "A" to "D": by the first of the limits that is not passed."""
    amount, ends = float(np.asarray(value)), np.asarray(limits, float)
    return _LETTERS[int(np.sum(amount > ends))]


def _words(value: Array, limits: Array) -> str:
    numbers_ = known(value), known(limits)
    return "" if numbers_[0] is None or numbers_[1] is None else f"zone {zone_of(*numbers_)}"


@takes(speed=number("rad/s", above=0.0), constants=_LIMITS)
def shaft_zone_limits(speed: Any, constants: Any = (4800.0, 9000.0, 13200.0)) -> Float[Array, "3"]:
    """Ends of the zones A, B and C of relative shaft vibration beside the bearings, m peak to peak:
    4800, 9000 and 13200/sqrt(n) µm with n in rpm; `speed` in rad/s (3600 rpm: 80, 150, 220 µm). For
    industrial machines from 1000 to 30 000 rpm; no more than the bearing's clearance bears. Raises
    `InputError` for limits that do not rise. Source: ISO 7919-3 / 20816-3, as commonly restated."""
    rpm = jnp.asarray(speed, float) * 30 / jnp.pi
    return 1e-6 * jnp.asarray(constants, float) / jnp.sqrt(rpm)


@takes(
    amplitude=None,
    speed=number("rad/s", above=0.0),
    accepted=None,
    constants=_LIMITS,
)
def shaft_vibration(
    amplitude: Any,
    speed: Any,
    accepted: Literal["A", "B", "C"] = "B",
    constants: Any = (4800.0, 9000.0, 13200.0),
    place: str = "",
) -> Assessment:
    """A shaft vibration, m peak to peak, against the end of the zone that is `accepted`. Raises `InputError`
    for another zone."""
    limits = shaft_zone_limits(speed, constants)
    return _against(amplitude, limits, accepted, ("shaft vibration", place, "m", SHAFT))


@takes(group=None, support=None)
def housing_zone_limits(
    group: Literal["1", "2"] = "1", support: Literal["rigid", "flexible"] = "rigid"
) -> Float[Array, "3"]:
    """Ends of the zones A, B and C of housing vibration, m/s RMS: group "1" above 300 kW, "2" from 15 to
    300 kW. Raises `InputError` for another group or support. Source: ISO 10816-3 / 20816-3, as commonly
    restated."""
    if (group, support) not in _VELOCITIES:
        raise InputError(
            f'group must be "1" or "2" and support "rigid" or "flexible", but they are {group!r} and '
            f"{support!r}"
        )
    return 1e-3 * jnp.asarray(_VELOCITIES[group, support])


@takes(velocity=None, group=None, support=None, accepted=None, limits=_LIMITS)
def housing_vibration(
    velocity: Any,
    group: Literal["1", "2"] = "1",
    support: Literal["rigid", "flexible"] = "rigid",
    accepted: Literal["A", "B", "C"] = "B",
    limits: Any = None,
    place: str = "",
) -> Assessment:
    """A housing's vibration, m/s RMS, against the end of the zone that is `accepted`; `limits` (3,): m/s, in
    place of those of the group. Raises `InputError` for another zone, group or support."""
    ends = housing_zone_limits(group, support) if limits is None else jnp.asarray(limits, float)
    return _against(velocity, ends, accepted, ("housing vibration", place, "m/s", HOUSING))


def _against(
    value: Any, limits: Array, accepted: str, words: tuple[str, str, str, str]
) -> Assessment:
    if accepted not in ("A", "B", "C"):
        raise InputError(f'accepted must be "A", "B" or "C", but is {accepted!r}')
    value = jnp.asarray(value, float)
    check, place, unit, source = words
    place = ", ".join(x for x in (place, _words(value, limits)) if x)
    limit = limits[_LETTERS.index(accepted)]
    return Assessment((Finding(check, place, value, limit, "at most", unit, source),))
