"""Which unbalance to apply for each critical speed, where, and how much."""

from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import names as name_list, number, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import is_concrete
from ..core.result_text import shows
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.rotors.body import RigidBody
from ..elements.rotors.rotor import Rotor
from ..linear.critical import critical_modes
from ..linear.modes import Mode
from ..linear.observe import at_stations
from ..machine.axial import axial_positions
from ..machine.machine import Machine
from ..machine.wiring import unknown
from ..simulation.summary import parts_with_mass
from .placed import PlacedUnbalance

SOURCE = "API RP 684 SP6.8.2.7 / API 617, as read in ross-report (analysis.py)"
# Of a mode's largest deflection: what is less on the other side does not make it a mode of two halves.
_HALF = 0.2
_FAR = 3.0  # times the greatest speed, up to which critical speeds count


@takes(
    mass=number("kg", least=0.0),
    speed=number("rad/s", above=0.0),
    constant=number(above=0.0),
    least_displacement=number("m", least=0.0),
)
def residual_unbalance_of_api(
    mass: Any, speed: Any, constant: Any = 6350.0, least_displacement: Any = 0.254e-6
) -> Float[Array, ""]:
    """U_r, kg·m (1 g·mm is 1e-6): `constant` W/N g·mm, W the mass (kg) that counts and N the greatest
    continuous speed in rpm (`speed` in rad/s); no less than W times `least_displacement`, which counts
    from 25 000 rpm on. To be applied are two of them: 100 kg at 9000 rpm: 141.111 g·mm. Raises
    `InputError` for what is out of bounds. Source: API 617 / 684, as read in ross-report, which has the floor
    a thousand times too high."""
    rpm = jnp.asarray(speed, float) * 30 / jnp.pi
    return jnp.maximum(1e-6 * constant / rpm, least_displacement) * mass


@takes(speed=number("rad/s", above=0.0), most=number("m", above=0.0), knee=number("rpm", above=0.0))
def probe_limit(speed: Any, most: Any = 25.4e-6, knee: Any = 12000.0) -> Float[Array, ""]:
    """A_vl, the vibration that probes may read in the mechanical run, m peak to peak: the less of `most` and
    `most sqrt(knee/N)`, N in rpm (`speed` in rad/s, the greatest continuous one; 15 000 rpm: 22.7185 µm).
    Raises `InputError` for what is out of bounds. Source: API 617 / API RP 684 SP6.8.2.11, as read in
    ross-report."""
    rpm = jnp.asarray(speed, float) * 30 / jnp.pi
    # the root has no slope where the other one counts
    return most * jnp.sqrt(jnp.minimum(1.0, knee / rpm))


@takes(limit=None, amplitude=None, most=number(above=0.0))
def scale_factor(limit: Any, amplitude: Any, most: Any = 6.0) -> Float[Array, ""]:
    """By which amplitudes are scaled before they are held against the clearances: `limit`/`amplitude` (both
    peak to peak, at the probes within the running speeds), `most` at most. Raises `InputError` for a `most`
    that is not positive. Source: API RP 684 SP6.8.2.11, as read in ross-report (which takes 0.5 at least)."""
    return jnp.minimum(most, jnp.asarray(limit, float) / jnp.asarray(amplitude, float))


@shows(without=("stations", "z", "shape", "bearings"), critical="rad/s")
class UnbalanceCase(eqx.Module):
    """An unbalance to be applied for one critical speed.

    - `name`: of the mode; `critical`: its undamped critical speed, rad/s. - `unbalance`: what to apply,
      where.
    - `kind`: "one" at the largest deflection, "two" out of phase, "overhung" at the end beyond the bearings.
    - `stations` (n,), all, their places `z` along the axis, m, and `shape` (n,): their deflections in the
      plane in which it is largest, largest 1. `bearings`: their two places, m.
    """

    name: str = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    critical: float = eqx.field(static=True)
    unbalance: PlacedUnbalance
    stations: tuple[str, ...] = eqx.field(static=True)
    z: np.ndarray
    shape: np.ndarray
    bearings: tuple[float, float] = eqx.field(static=True)

    plot = plot_door()


@takes(
    speed=number("rad/s", above=0.0),
    bearings=name_list,
    count=whole(1),
    constant=number(above=0.0),
    multiple=number(above=0.0),
    least_displacement=number("m", least=0.0),
)
def unbalance_cases(
    machine: Machine,
    speed: float,
    bearings: Sequence[str] | None = None,
    count: int = 2,
    *,
    multiple: float = 2.0,
    constant: float = 6350.0,
    least_displacement: float = 0.254e-6,
) -> tuple[UnbalanceCase, ...]:
    """What to apply for the `count` lowest undamped forward critical speeds (below three times `speed`), for
    a machine whose greatest continuous speed is `speed` (rad/s): `multiple` times U_r, placed by the mode's
    shape, with the stiffness of its supports at that speed.

    - A mode that bends to one side: at its largest deflection, W the rotor's mass. - One that bends to both
      sides between the bearings: at the largest deflection of either, half a turn apart, W the mass that each
      one's nearer journal bears. - One that is largest at a rotor beyond a bearing: there, W the mass beyond
      the bearing; where rotors beyond both bearings deflect by more than a fifth of it, at both, each to its
      own side.

    `bearings`: the two journal bearings, names of supports or of their stations; by default the two supports
    there are. W by levers of the masses; amounts are numbers of this machine, no derivatives (give
    `2 * residual_unbalance_of_api(total_mass(machine), speed)` where these matter). Not for use under `jit`.
    Raises `InputError` for names that are none, where `bearings` are not two at different places, and for
    traced machines. Source: API RP 684 SP6.8.2.7, as read in ross-report.
    """
    if not all(map(is_concrete, jax.tree.leaves(machine))):
        raise InputError("unbalance_cases places by numbers: call it outside of jit and vmap")
    places = axial_positions(machine)
    stations = machine.wiring.stations
    ends = sorted(places[s] for s in _bearing_stations(machine, bearings))
    if ends[0] == ends[1]:
        raise InputError(f"bearings: both lie at {ends[0]:g} m: two different places are needed")
    low, high = ends
    parts = parts_with_mass(machine)
    rotors = np.array([isinstance(_part_at(machine, s), (Rotor, RigidBody)) for s in stations])
    found = []
    z = np.array([places[s] for s in stations])
    modes = critical_modes(
        machine, count=count, speeds=(0.0, _FAR * speed), whirl="forward", stiffness_at=speed
    )
    for mode in modes:
        shape = _deflections(machine, mode)
        kind, where = _placed(shape, z, low, high, rotors)
        masses = [_mass(parts, kind, z[k], low, high) for k in where]
        amounts = [
            multiple * float(residual_unbalance_of_api(m, speed, constant, least_displacement))
            for m in masses
        ]
        angles = [0.0 if shape[k] >= 0 else np.pi for k in where]
        unbalance = PlacedUnbalance(
            tuple(stations[k] for k in where), jnp.asarray(amounts), jnp.asarray(angles)
        )
        names = tuple(stations)
        found.append(
            UnbalanceCase(mode.name, kind, mode.frequency, unbalance, names, z, shape, (low, high))
        )
    return tuple(found)


def _part_at(machine: Machine, station: str) -> Any:
    """What stands at a station; nothing inside a shaft."""
    return machine[station] if station in machine.wiring.order else None


def _bearing_stations(machine: Machine, given: Any) -> list[str]:
    """Two of them."""
    connections, stations = machine.connections(), machine.wiring.stations
    if given is None:
        kinds = (LinearSupport, SpeedDependentSupport)
        journals = [
            name
            for name, e in machine.elements().items()
            if isinstance(e, kinds)
            or type(e).__name__
            in (
                "JournalBearing",
                "FixedPadBearing",
                "TiltingPadBearing",
                "RollingBearing",
                "RadialBearing",
            )
        ]
        given = journals
    given = [given] if isinstance(given, str) else list(given)
    if len(given) != 2:
        raise InputError(
            f"bearings: two are needed, but there are {len(given)} ({', '.join(given) or 'none'}): name them"
        )
    out = []
    for name in given:
        if name in connections:
            out.append(connections[name][0].partition(".")[0])
        elif name in stations:
            out.append(name)
        else:
            raise InputError(f"bearings: {unknown('bearing', name, (*connections, *stations))}")
    return out


def _deflections(machine: Machine, mode: Mode) -> np.ndarray:
    """(stations,), real, in the plane in which the largest one moves, largest 1."""
    every = np.asarray(at_stations(machine, jnp.asarray(mode.shape)))[:, :2]
    size = np.abs(every[:, 0]) ** 2 + np.abs(every[:, 1]) ** 2
    k = int(np.argmax(size))
    # where the largest one's orbit is longest; the others seen at that instant, along that direction
    instant = (
        np.exp(-0.5j * np.angle(np.sum(every[k] ** 2)))
        if abs(np.sum(every[k] ** 2)) > 1e-9 * size[k]
        else 1.0
    )
    there = np.real(every * instant)
    direction = there[k] / np.linalg.norm(there[k])
    found = there @ direction
    return found / found[k]


def _placed(
    shape: np.ndarray, z: np.ndarray, low: float, high: float, rotors: np.ndarray
) -> tuple[str, list[int]]:
    """The kind of a case, and the stations at which unbalance goes. A bare shaft end beyond a bearing is none
    to place at."""
    between = np.flatnonzero((z >= low) & (z <= high))
    beyond = [rows[rotors[rows]] for rows in (np.flatnonzero(z < low), np.flatnonzero(z > high))]
    every = np.concatenate([between, *beyond]).astype(int)
    top = int(every[np.argmax(np.abs(shape[every]))])
    if z[top] < low or z[top] > high:
        ends = [int(rows[np.argmax(np.abs(shape[rows]))]) for rows in beyond if rows.size]
        size = abs(shape[top])
        return "overhung", [k for k in ends if k == top or abs(shape[k]) > _HALF * size]
    other = int(between[np.argmin(shape[between] * np.sign(shape[top]))])
    if shape[other] * np.sign(shape[top]) < -_HALF * abs(shape[top]):
        return "two", sorted([top, other])
    return "one", [top]


def _mass(parts, kind: str, z: float, low: float, high: float) -> float:
    """kg that count for an unbalance at z."""
    mass = sum(p.mass for p in parts)
    if kind == "overhung":
        left = z < low
        return sum(p.mass for p in parts if (p.position < low if left else p.position > high))
    if kind == "one":
        return mass
    centre = sum(p.mass * p.position for p in parts) / mass
    loads = mass * (high - centre) / (high - low), mass * (centre - low) / (high - low)
    return loads[int(abs(z - high) < abs(z - low))]


@takes(clearances=None)
def at_clearances(
    machine: Machine, clearances: Mapping[str, tuple[float, float]]
) -> dict[str, Machine]:
    """The machine with each of its films at its least and at its greatest clearance: `clearances`: name of a
    `JournalBearing` or `SqueezeFilmDamper` -> (least, greatest), radial, m. For `unbalance_response_check`;
    bearings given as tables have a machine of the user's for each. Raises `InputError` for an element that
    has no clearance, and for two that do not rise."""
    if not isinstance(clearances, Mapping) or not clearances:
        raise InputError(
            f"clearances must be a mapping bearing -> (least, greatest), but is {clearances!r}"
        )
    for name, pair in clearances.items():
        if not hasattr(machine[name], "clearance"):
            raise InputError(
                f"clearances: `{name}` is a {type(machine[name]).__name__}, which has none: make a machine "
                "for each clearance and give both"
            )
        if not isinstance(pair, (tuple, list)) or len(pair) != 2 or not pair[0] <= pair[1]:
            raise InputError(
                f"clearances of `{name}` must be (least, greatest), m, but are {pair!r}"
            )
    return {
        word: machine.set({f"{name}.clearance": pair[k] for name, pair in clearances.items()})
        for k, word in enumerate(("least clearance", "greatest clearance"))
    }
