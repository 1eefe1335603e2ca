"""Orbits: what a shaft's centre draws, all of it or chosen orders alone, and the ellipses it is made of."""

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import TURN
from ..core.result_text import shows
from .orders import OrderTrack, track
from .shaft_angle import with_pair

# Points of a curve in a turn.
_POINTS = 360
# Orders that repeat after so many turns at most are drawn closed.
_LONGEST = 12
# An ellipse as thin as this part of its length is a straight line.
_STRAIGHT = 1e-9


@shows(inclination="rad")
class Ellipse(NamedTuple):
    """One order of an orbit.

    - `major`, `minor`: semi-axes, in the unit of x and y, not negative.
    - `inclination`: rad, of the major axis from x towards y, from -pi/2 to pi/2 (a circle has none).
    - `forward`, `backward`: complex amplitudes of the circles run through with and against the shaft's
      rotation: x + i y = forward e^(i order phi) + backward e^(-i order phi).
    """

    major: float
    minor: float
    inclination: float
    forward: complex
    backward: complex

    @property
    def precession(self) -> int:
        """1 forward (with the rotation), -1 backward, 0 on a straight line."""
        if self.minor <= _STRAIGHT * self.major:
            return 0
        return 1 if abs(self.forward) > abs(self.backward) else -1


def ellipse(x: complex, y: complex) -> Ellipse:
    """Of the motion Re(x e^(i a)), Re(y e^(i a)) as a grows with the shaft's angle."""
    forward = (complex(x) + 1j * complex(y)) / 2
    backward = np.conj(complex(x) - 1j * complex(y)) / 2
    f, b = abs(forward), abs(backward)
    inclination = 0.5 * np.angle(forward * backward) if f > 0 and b > 0 else 0.0
    return Ellipse(float(f + b), float(abs(f - b)), float(inclination), forward, complex(backward))


@shows(angle="rad", speed="rad/s")
class Orbit(NamedTuple):
    """A curve about its own mean.

    - `angle`: (n,), rad, the shaft's, from 0 at a mark of the keyphasor.
    - `x`, `y`: (n,), in the unit of the signals, less `centre`.
    - `keyphasor`: (k, 2), where the mark passed, once a turn, the start first (and the end not again).
    - `centre`: (2,), the mean position.
    - `speed`: rad/s, mean.
    - `orders`: (m,) of a filtered orbit; none of one that shows all.
    - `amplitude`: (m, 2) complex, of x and y: the curve is the sum of Re(amplitude e^(i order phi)).
    """

    angle: np.ndarray
    x: np.ndarray
    y: np.ndarray
    keyphasor: np.ndarray
    centre: np.ndarray
    speed: float
    orders: np.ndarray
    amplitude: np.ndarray

    plot = plot_door()

    @takes(order=positive())
    def ellipse(self, order: float = 1.0) -> Ellipse:
        """Of one of the `orders`. Raises `InputError` for another one."""
        at = np.flatnonzero(np.abs(self.orders - order) < 1e-9)
        if not at.size:
            have = ", ".join(f"{k:g}" for k in self.orders) or "none: it is not filtered"
            raise InputError(
                f"`order`: must be one of the orbit's, {have}, but is {order!r}: filter it with that order"
            )
        x, y = self.amplitude[at[0]]
        return ellipse(x, y)


@takes(sample_rate=positive("Hz"), turns=whole(1))
def orbit(
    x: Float[Array | np.ndarray, " n"],
    y: Float[Array | np.ndarray, " n"],
    angle: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    turns: int = 4,
) -> Orbit:
    """The last whole `turns` of an orbit with all that is in it, as a dense curve.

    **Arguments:** `x`, `y`: (nt,), one unit, a right angle apart; `angle`: (nt,), rad, of the shaft, never
    turning back; `sample_rate`: Hz. The turns begin and end at the keyphasor's mark, phi = 2 pi k. Raises
    `InputError`.
    """
    turning, xy = with_pair(x, y, angle, sample_rate)
    marks = turning.marks()
    if marks.size <= turns:
        raise InputError(
            f"`turns`: must fit into the record, which has {max(marks.size - 1, 0)} whole turns from mark "
            f"to mark, but is {turns}: choose fewer, or run longer"
        )
    along = TURN / _POINTS * np.arange(_POINTS * turns + 1)
    at = turning.instants(np.minimum(marks[-1 - turns] + along, marks[-1]))
    curve = turning.at(xy, at)
    centre = curve[:-1].mean(axis=0)
    speed = float(turning.sense * TURN * turns / (at[-1] - at[0]))
    none = np.zeros(0)
    about = curve - centre
    along = turning.sense * along
    return Orbit(
        along, about[:, 0], about[:, 1], about[:-1:_POINTS], centre, speed, none, np.zeros((0, 2))
    )


@takes(sample_rate=positive("Hz"), turns=whole(1))
def filtered_orbit(
    x: Float[Array | np.ndarray, " n"],
    y: Float[Array | np.ndarray, " n"],
    angle: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    orders: Any = (1.0,),
    turns: int | None = None,
    window: Any = "boxcar",
) -> Orbit:
    """The orbit made of chosen orders alone: 1x, 1x + 2x, 0.5x + 1x ...

    **Arguments:** as for `orbit` and `order_tracking`; amplitudes are those of the last whole `turns` (by
    default all there are), over which the motion should be steady. `ellipse(order)` of what is returned has
    semi-axes, inclination and precession. The curve closes where its orders repeat within 12 turns.
    Raises `InputError` as `order_tracking` does.
    """
    turning, xy = with_pair(x, y, angle, sample_rate)
    there = turning.marks().size - 1
    turns = max(there, 1) if turns is None else turns
    # blocks counted from the end
    first = max(there - turns, 0)
    found: OrderTrack = track(turning, xy, orders, turns, max(first, 1), window)
    wanted, amplitude = found.orders, found.amplitude[-1]
    length = _repeats(wanted)
    along = turning.sense * TURN / _POINTS * np.arange(_POINTS * length + 1)
    curve = np.einsum("km,kn->nm", amplitude, np.exp(1j * np.outer(wanted, along))).real
    speed = float(found.speed[-1])
    marks, mean = curve[:-1:_POINTS], found.mean[-1]
    return Orbit(along, curve[:, 0], curve[:, 1], marks, mean, speed, wanted, amplitude)


def _repeats(orders: np.ndarray) -> int:
    """Turns after which all orders repeat."""
    parts = [Fraction(float(k)).limit_denominator(_LONGEST) for k in orders]
    return min(math.lcm(*(p.denominator for p in parts)), _LONGEST)
