"""Unbalance placed at stations, whatever they carry, and what it makes the machine do."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import number, numbers
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import known
from ..core.protocol import Nominal
from ..core.quick import traced
from ..core.result_text import shows
from ..elements.rotors.rotor import Rotor
from ..linear.condensing import condensed_below
from ..linear.coordinates import coordinate_order, row_of
from ..linear.linearise import check_linearized, linearize, rates_over_speed
from ..linear.resolvent import resolvent
from ..linear.response import FrequencyResponse, as_complex, solve
from ..machine.machine import Machine
from ..machine.speed_ratios import is_geared
from ..machine.wiring import unknown
from ..simulation.condensing import may_condense
from .curve import without_slopes

Probe = str | tuple[str, float]
"""`"main.x"`, `"main.y"`; `("main", 0.785)`: along the direction at that angle (rad) from x towards y;
`"main"`: the orbit's long half axis."""


@shows(amounts="kg*m", angles="rad")
class PlacedUnbalance(eqx.Module):
    """Unbalances at stations: `amounts` (n,), kg·m (1 g·mm is 1e-6), at `angles` (n,), rad, on the rotor. A
    station that carries no rotor takes them too. `couples` (n,): moment unbalances about the stations, kg·m²,
    complex: the sum of amount times distance along z times e^(i angle); none where left out."""

    stations: tuple[str, ...] = eqx.field(static=True)
    amounts: Float[Array, " n"]
    angles: Float[Array, " n"]
    couples: Complex[Array, " n"] | None = None


def as_placed(given: Any) -> PlacedUnbalance:
    """Of a mapping: station -> kg·m, or (kg·m, rad). Raises `InputError`."""
    if isinstance(given, PlacedUnbalance):
        return given
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "unbalance must be a PlacedUnbalance or a mapping station -> kg*m, or (kg*m, rad), but is "
            f"{given!r}"
        )
    pairs = []
    for station, value in given.items():
        alone = not isinstance(value, (tuple, list))
        value = (value, 0.0) if alone else value
        if len(value) != 2:
            raise InputError(
                f"unbalance of {station!r} must be an amount in kg*m, or (amount, angle in rad), but has "
                f"{len(value)} entries"
            )
        amount = number("kg*m")(value[0], f"unbalance of {station!r}")
        pairs.append((amount, number("rad")(value[1], f"angle of the unbalance of {station!r}")))
    amounts, angles = (jnp.stack([jnp.asarray(x, float) for x in part]) for part in zip(*pairs))
    return PlacedUnbalance(tuple(given), amounts, angles)


def own_unbalance(machine: Machine) -> PlacedUnbalance:
    """Static and dynamic, of the machine's rotors. Raises `InputError` where there is none, and where
    anything else turns with the shaft."""
    found: dict[str, tuple[Any, Any, Any]] = {}
    others = []
    for name, part in machine.elements().items():
        if isinstance(part, Rotor) and part.imperfection is None:
            u = part.unbalance
            gap = part.transverse_inertia - part.polar_inertia
            lean = jnp.exp(1j * (u.inclination_angle + part.angle))
            couple = -0.5j * gap * jnp.sin(2 * u.inclination) * lean
            found[name] = part.mass * u.eccentricity, u.angle + part.angle, couple
        elif isinstance(part, Nominal):
            own, left = jax.tree.leaves(part), jax.tree.leaves(part.nominal())
            if not (len(own) == len(left) and all(a is b for a, b in zip(own, left))):
                others.append(name)
    if others:
        raise InputError(
            f"unbalance: `{others[0]}` turns with the shaft and is no Rotor with an Unbalance alone: give "
            "what is to be applied, unbalance={station: kg*m}"
        )
    sizes = [known(jnp.stack([jnp.abs(x) for x in (u, c)])) for u, _, c in found.values()]
    if not any(size is None or np.any(size > 0) for size in sizes):
        raise InputError(
            "unbalance: the rotors of this machine have none: give what is to be applied, "
            "unbalance={station: kg*m}"
        )
    amounts, angles, couples = map(jnp.stack, zip(*found.values()))
    return PlacedUnbalance(tuple(found), amounts, angles, couples)


class Seen(NamedTuple):
    """What a probe reads of the motion q (n,) is |one q| + |other q|: complex rows (n,)."""

    one: Array
    other: Array


class Excited(eqx.Module):
    """A machine, its generalized forces per squared speed (n,), and how it is linearised."""

    machine: Machine
    forces: Complex[Array, " n"]
    at: Any

    def motion(self, speed: Array) -> Complex[Array, " n"]:
        """Steady whirl at a speed, rad/s: complex amplitudes of the coordinates."""
        model = linearize(self.machine, speed, self.at)
        whirl = solve(model.A, speed, speed**2 * (as_complex(model.B) @ self.forces))
        return whirl[: self.forces.shape[0]]

    def level(self, speed: Array, seen: Seen) -> Float[Array, ""]:
        """log of what a probe reads."""
        q = self.motion(speed)
        return jnp.log(jnp.abs(seen.one @ q) + jnp.abs(seen.other @ q))

    def numbers(self, speeds: np.ndarray) -> Callable[[float], np.ndarray]:
        """`motion` at any speed among these, where no derivative is asked."""
        run: Excited = jax.tree.map(
            lambda x: np.asarray(known(x)) if eqx.is_array(x) else x, without_slopes(self)
        )
        rates, forces = (
            rates_over_speed(without_slopes(self.machine), speeds, self.at),
            run.forces,
        )

        def motion(w: float) -> np.ndarray:
            (A, B), n = rates(w), forces.shape[0]
            return resolvent(A, n, 1j * w, w**2 * (B @ forces))[:n]

        return motion


def several(probes: Any) -> Sequence[Probe]:
    """One probe, or a list of them. Raises `InputError`."""
    pair = (
        isinstance(probes, tuple) and len(probes) == 2 and not isinstance(probes[1], (str, tuple))
    )
    found = [probes] if isinstance(probes, str) or pair else probes
    if not isinstance(found, (list, tuple)) or not found:
        raise InputError(
            "probes must be a station, station.x, (station, angle in rad) or a list of these, but is "
            f"{probes!r}"
        )
    return found


def stations_of(probes: Sequence[Probe]) -> list[str]:
    return [
        p[0] if isinstance(p, tuple) else p.rpartition(".")[0] or p if p.rpartition(".")[2] in COORDINATES
        else p
        for p in probes
    ]  # fmt: skip


def words_of(probe: Probe) -> str:
    if isinstance(probe, tuple):
        angle = known(probe[1])
        return f"{probe[0]} at {np.rad2deg(float(angle)):.4g}°" if angle is not None else probe[0]
    return probe


def excited(
    machine: Machine, unbalance: Any, probes: Sequence[Probe], highest: float, at: Any
) -> tuple[Excited, tuple[Seen, ...]]:
    """The machine under an unbalance (`None`: its own), and its probes; a large machine reduced for speeds up
    to `highest`. Raises `InputError` for names that are none."""
    check_linearized(at)
    machine.check()
    placed = own_unbalance(machine) if unbalance is None else as_placed(unbalance)
    if is_geared(machine):
        raise InputError(
            "unbalance: in a machine with gears a placed unbalance has no one speed: set those of its rotors "
            "and take unbalance_response(shaft=...)"
        )
    for probe in probes:
        pair = isinstance(probe, tuple) and len(probe) == 2 and isinstance(probe[0], str)
        if not (pair or (isinstance(probe, str) and probe.strip())):
            raise InputError(
                f"a probe must be a station, station.x or (station, angle in rad), but is {probe!r}"
            )
    names = machine.wiring.stations
    for station in (*placed.stations, *stations_of(probes)):
        if station not in names:
            raise InputError(unknown("station", station, names))
    if may_condense(machine):
        keep = {names.index(s) for s in (*placed.stations, *stations_of(probes))}
        machine = condensed_below(machine, highest, at, tuple(sorted(keep)))
    labels = coordinate_order(machine)[3]
    forces = jnp.zeros(len(labels), complex)
    for k, station in enumerate(placed.stations):
        turned = placed.amounts[k] * jnp.exp(1j * placed.angles[k])
        couple = 0.0 if placed.couples is None else placed.couples[k]
        # along x and, a quarter later, along y; a force on an arm z turns theta by z Fx, psi by -z Fy
        for c, amount in (
            ("x", turned),
            ("y", -1j * turned),
            ("theta", couple),
            ("psi", 1j * couple),
        ):
            if (station, c) in labels:
                forces = forces.at[labels.index((station, c))].add(amount)
        if (station, "x") not in labels and (station, "y") not in labels:
            row_of(labels, f"{station}.x")  # tells why
    return Excited(machine, forces, at), tuple(_seen(labels, p) for p in probes)


def _seen(labels: tuple[tuple[str, str], ...], probe: Probe) -> Seen:
    rows = jnp.zeros((2, len(labels)), complex)
    if isinstance(probe, tuple):
        angle = number("rad")(probe[1], f"angle of the probe at {probe[0]!r}")
        rows = rows.at[0, row_of(labels, f"{probe[0]}.x")].set(jnp.cos(angle))
        return Seen(*rows.at[0, row_of(labels, f"{probe[0]}.y")].add(jnp.sin(angle)))
    if (probe.rpartition(".")[0], probe.rpartition(".")[2]) in labels or "." in probe:
        return Seen(*rows.at[0, row_of(labels, probe)].set(1.0))
    # forward and backward circles, whose sum is the long half axis
    for k, sign in enumerate((1j, -1j)):
        rows = rows.at[k, row_of(labels, f"{probe}.x")].set(0.5)
        rows = rows.at[k, row_of(labels, f"{probe}.y")].set(0.5 * sign)
    return Seen(*rows)


@takes(speeds=numbers("rad/s"), outputs=None)
def placed_response(
    machine: Machine,
    unbalance: Any,
    outputs: Sequence[str],
    speeds: Any,
    at: Any = "equilibrium",
) -> FrequencyResponse:
    """As `unbalance_response`, under `unbalance` alone: a `PlacedUnbalance` or a mapping station -> kg·m, or
    (kg·m, rad). The machine's own is left out. `outputs`: coordinates such as `"main.x"`. Differentiable in
    both modes. Raises `InputError` for names that the machine does not have, for speeds that are not finite
    or at which a motion has no bound, and for machines with gears."""
    outputs = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    speeds = jnp.atleast_1d(jnp.asarray(speeds, float))
    given = known(speeds)
    highest = float(np.abs(given).max()) if given is not None else 0.0
    run, seen = excited(machine, unbalance, outputs, highest, at)
    rows = jnp.stack([one for one, _ in seen])
    if traced(run, rows, speeds):
        values = _responses(run, rows, speeds)
    else:
        motion = run.numbers(np.asarray(speeds))
        values = jnp.asarray(np.array([np.asarray(rows) @ motion(float(w)) for w in speeds]))
    units = tuple("m" if o[-1] in "xyz" else "rad" for o in outputs)
    return FrequencyResponse(speeds, values, outputs, (), "receptance", units)


@eqx.filter_jit
def _responses(run: Excited, rows: Array, speeds: Array) -> Array:
    return jax.lax.map(lambda w: rows @ run.motion(w), speeds)
