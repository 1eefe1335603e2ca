"""Torsional separation: how far natural frequencies lie from all that excites them over the speeds of
operation."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, numbers, positive, short, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.quick import traced
from ..core.result_text import shows
from ..elements.couplings.gear import GearMesh
from ..elements.couplings.involute_mesh import InvoluteMesh
from ..elements.couplings.planetary import PlanetaryGear
from ..linear.instant import prepare
from ..linear.linearise import linearize
from ..linear.shafts import shafts_of
from ..linear.torsion import torsional
from ..machine.machine import Machine
from ..machine.system import assemble
from ..machine.wiring import unknown
from .finding import Assessment, Finding

# Wang, Feese & Pettinato, 41st Turbomachinery Symposium (2012), of "the API recommended separation margin"
TENTH = "API 684 and 617, told by Wang et al. 2012"
# Of the highest excitation: up to where modes are told where no count is given.
_BEYOND = 1.5


@shows(frequency="rad/s as Hz")
class TorsionalExcitation(NamedTuple):
    """What may excite torsion: `order` periods in a turn of the shaft that the station `shaft` stands on
    (`None`: the driven one), or a fixed `frequency`, rad/s, where that is not 0."""

    name: str
    order: float = 0.0
    shaft: str | None = None
    frequency: float = 0.0


@takes(line_frequency=positive("Hz"), orders=numbers(above=0.0))
def torsional_excitations(
    machine: Machine,
    line_frequency: float | None = None,
    orders: Sequence[float] = (1.0, 2.0),
    mesh: bool = True,
) -> tuple[TorsionalExcitation, ...]:
    """What a torsional analysis looks at: each of the `orders` of every shaft, by the name of its first
    station with a station's own; the line's frequency (Hz) and twice that, where one is given; and, with
    `mesh`, the tooth frequency of each `GearMesh` or `InvoluteMesh`, by its number of `teeth`, and of each
    `PlanetaryGear`, by how fast its sun and carrier turn.

    A shaft is what turns at one speed, between the gears. Add your own: the result is a tuple of
    `TorsionalExcitation`. Source: the list of API 684's torsional tutorial as open papers give it (Wang,
    Feese & Pettinato 2012: once and twice the speed of each shaft, once and twice the line's frequency).
    Raises `InputError` for what is not positive.
    """
    machine.check()
    found = []
    for shaft in shafts_of(machine):
        name = shaft[0]
        found += [TorsionalExcitation(f"{name} {order:g}x", float(order), name) for order in orders]
    if line_frequency is not None:
        w = 2 * np.pi * float(line_frequency)
        found += [
            TorsionalExcitation("line frequency", frequency=w),
            TorsionalExcitation("2x line frequency", frequency=2 * w),
        ]
    for name, element in machine.elements().items() if mesh else ():
        if isinstance(element, (GearMesh, InvoluteMesh)):
            first = machine.connections()[name][0].partition(".")[0]
            teeth = known(element.teeth)
            if teeth is None:
                raise InputError(
                    f"`{name}`: teeth must be a known number, not one that is differentiated"
                )
            found.append(TorsionalExcitation(f"{name} teeth", float(teeth), first))
        if isinstance(element, PlanetaryGear):
            found.append(_planets_mesh(machine, name, element))
    return tuple(found)


def _planets_mesh(machine: Machine, name: str, gear: PlanetaryGear) -> TorsionalExcitation:
    """`z_s (w_s - w_c)`, as an order of the faster of these two."""
    turns, teeth = known(_turns(machine)), known(gear.teeth)
    if turns is None or teeth is None:
        raise InputError(
            f"`{name}`: teeth and ratios must be known numbers, not ones that are differentiated"
        )
    sun, carrier, _ = (place.partition(".")[0] for place in machine.connections()[name])
    own = {place: float(turns[machine.wiring.stations.index(place)]) for place in (sun, carrier)}
    shaft = max(own, key=lambda place: abs(own[place]))
    order = float(teeth[0]) * abs(own[sun] - own[carrier]) / max(abs(own[shaft]), 1e-300)
    return TorsionalExcitation(f"{name} teeth", order, shaft)


def _turns(machine: Machine) -> Float[Array, " n"]:
    """Of each station, times the driven one's."""
    if traced(machine):
        return assemble(machine, nominal=True).turns()
    return jnp.asarray(prepare(machine).system.turns())


@takes(natural=number(), low=number(), high=number())
def torsional_margin(natural: Any, low: Any, high: Any) -> Float[Array, ""]:
    """How far a natural frequency lies from an excitation that runs from `low` to `high` (all in one unit),
    as a part of the excitation's nearer end: `max(1 - natural/low, natural/high - 1)`. Negative within the
    range, by the way out. Raises `InputError` for what is no number."""
    return jnp.maximum(1 - natural / low, natural / high - 1)


@takes(margin=number(least=0.0), count=whole(1))
def torsional_separation(
    machine: Machine,
    speeds: tuple[float, float],
    excitations: Sequence[TorsionalExcitation] | None = None,
    line_frequency: float | None = None,
    margin: float = 0.10,
    count: int | None = None,
    each: bool = False,
    at: Any = "undeformed",
) -> Assessment:
    """Whether all torsional natural frequencies lie `margin` away from every excitation, anywhere in the
    range of `speeds`.

    - `speeds`: (low, high) of the driven shaft, rad/s; twice the same for a machine of one speed.
    - `excitations`: as `torsional_excitations` lists them, which is the default, with `line_frequency` (Hz).
    - `margin`: the least separation, a part of the excitation's frequency.
    - `count`: of the lowest modes; needed under `jit`. Left out: all up to one and a half times the highest
      excitation.
    - `each`: a finding for each mode and excitation; else one a mode, of the excitation nearest to it.

    The findings are `torsional_margin`, negative by how deep a frequency lies in a range. Natural frequencies
    are |lambda| of the machine at the middle of `speeds`, its lateral motion held. Differentiable by every
    parameter of the machine, ratios of gears too (of two modes that change places, the lower's). Source: API
    684 and 617 ask for 10 %; their text was not seen, but Wang, Feese & Pettinato (2012) on them. Raises
    `InputError` for speeds that are no range above 0, and names that are no stations.
    """
    low, high = speed_range(speeds)
    if excitations is None:
        excitations = torsional_excitations(machine, line_frequency)
    bands = excitation_bands(machine, excitations, (low, high))
    found = natural_torsion(machine, 0.5 * (low + high), at)
    numbers_ = known(found)
    if count is None:
        if numbers_ is None:
            raise InputError("count: under `jit` say how many of the lowest modes are looked at")
        top = _BEYOND * float(np.max(np.asarray(known(bands)), initial=0.0))
        count = int(np.sum((numbers_ > 0) & (numbers_ < top)))
    margins = jnp.maximum(1 - found[:, None] / bands[:, 0], found[:, None] / bands[:, 1] - 1)
    told = []
    for k in range(min(count, found.shape[0])):
        name = f"torsional {k + 1}"
        for e in range(len(excitations)) if each else (None,):
            if e is None:
                one, values = jnp.argmin(margins[k]), known(margins[k])
                whose = "" if values is None else f", {excitations[int(np.argmin(values))].name}"
                value, place = margins[k, one], name + whose
            else:
                value, place = margins[k, e], f"{name}, {excitations[e].name}"
            told.append(
                Finding(
                    "torsional separation",
                    place,
                    value,
                    jnp.asarray(float(margin)),
                    "at least",
                    "",
                    TENTH,
                )
            )
    return Assessment(tuple(told))


def speed_range(speeds: Any) -> tuple[float, float]:
    """(low, high), rad/s; raises `InputError`."""
    try:
        low, high = (float(speed) for speed in speeds)
    except (TypeError, ValueError):
        low = high = 0.0
    if not 0 < low <= high < np.inf:
        raise InputError(
            f"speeds must be (low, high) in rad/s, above 0 and in this order, but is {speeds!r}"
        )
    return low, high


def natural_torsion(machine: Machine, speed: float, at: Any) -> Float[Array, " n"]:
    """Torsional natural frequencies, rad/s, rising; 0 at the end for what does not swing."""
    return torsional(linearize(machine, speed, at)).natural_frequencies


def excitation_bands(
    machine: Machine, excitations: Sequence[TorsionalExcitation], speeds: tuple[float, float]
) -> Float[Array, "e 2"]:
    """Lowest and highest frequency of each excitation in the range of speeds of the driven shaft, rad/s."""
    stations = machine.wiring.stations
    turns = _turns(machine)
    if not isinstance(excitations, (list, tuple)) or not all(
        isinstance(one, TorsionalExcitation) for one in excitations
    ):
        raise InputError(
            f"excitations must be a list of TorsionalExcitation, but is {short(excitations)}"
        )
    rows = []
    for one in excitations:
        if one.shaft is not None and one.shaft not in stations:
            raise InputError(f"`{one.name}`: shaft: {unknown('station', one.shaft, stations)}")
        if not (one.frequency > 0) and not (one.order > 0):
            raise InputError(f"`{one.name}`: give an order or a frequency above 0")
        if one.frequency > 0:
            rows.append(jnp.full(2, one.frequency))
        else:
            ratio = 1.0 if one.shaft is None else jnp.abs(turns[stations.index(one.shaft)])
            rows.append(one.order * ratio * jnp.asarray(speeds))
    return jnp.stack(rows) if rows else jnp.zeros((0, 2))
