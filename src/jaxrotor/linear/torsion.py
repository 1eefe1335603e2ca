"""Torsion in its own right: modes with the torque in every shaft, and what excites them where."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..core.arguments import number, numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.protocol import AbstractConnector, Signalling
from ..core.quick import traced
from ..core.result_text import HERTZ, shows
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from .coordinates import coordinate_order
from .instant import ratio_of
from .linearise import LinearModel, check_linearized
from .lowest_modes import lowest
from .observe import outputs_of
from .response import observed

# Of the highest speed, up to which meetings are told.
_BEYOND = 1.5


@shows(without=("angles", "torques", "inertia_torques", "tooth_forces"), frequency=HERTZ)
class TorsionalMode(NamedTuple):
    """One torsional mode, the largest angle 1 rad.

    - `name`: "torsional 1", ...; `frequency`: rad/s; `damping_ratio`.
    - `angles`: station -> complex angle, rad.
    - `torques`: shaft, coupling or gear -> complex torque in it, N·m; of a gear that upon its first wheel,
      whose `tooth_forces` (N) are told too.
    - `inertia_torques`: station -> what its inertia asks for, N·m: Holzer's column `J w² angle`.
    """

    name: str
    frequency: float
    damping_ratio: float
    angles: dict[str, complex]
    torques: dict[str, complex]
    inertia_torques: dict[str, complex]
    tooth_forces: dict[str, complex] = {}


@shows(speed="rad/s")
class Interference(NamedTuple):
    """A natural frequency met by an order of excitation at `speed`, rad/s; `separation`: how far that is
    from the range of speeds, as a part of its nearer end; 0 within."""

    mode: str
    order: float
    speed: float
    separation: float


@takes()
def torsional(model: LinearModel) -> LinearModel:
    """The twisting of a linear model alone, all other coordinates held: a `LinearModel` over phi.
    Raises `InputError` where nothing can twist."""
    rows = np.array([i for i, (_, c) in enumerate(model.coordinates) if c == "phi"], int)
    if not rows.size:
        raise InputError("nothing can twist in this machine: every phi is held")
    if traced(model):
        return _twisting(model, rows, jnp)
    return jax.tree.map(jnp.asarray, _twisting(jax.tree.map(np.asarray, model), rows, np))


def _twisting(model: LinearModel, rows: np.ndarray, xp: Any) -> LinearModel:
    """`torsional`, of NumPy's or JAX's arrays."""
    n, d = model.M.shape[0], model.A.shape[0]
    inside = np.arange(2 * n, d)
    M, C, G, K = (x[np.ix_(rows, rows)] for x in (model.M, model.C, model.G, model.K))
    pull = (model.M @ model.A[n : 2 * n][:, inside])[rows]
    zero, one = xp.zeros(K.shape), xp.eye(rows.size)
    top = xp.concatenate([zero, one, xp.zeros((rows.size, inside.size))], axis=1)
    middle = xp.linalg.solve(M, xp.concatenate([-K, -C - G, pull], axis=1))
    whole = np.concatenate([rows, n + rows, inside])
    # internal states feel accelerations (a ring is left behind by its hub): those of the twisting alone
    felt = model.B[inside] @ model.M
    own = (model.A[inside] - felt @ model.A[n : 2 * n])[:, whole]
    A = xp.concatenate([top, middle, own + felt[:, rows] @ middle])
    quick = xp.linalg.inv(M)
    B = xp.concatenate([zero, quick, felt[:, rows] @ quick])
    labels = tuple(model.coordinates[i] for i in rows)
    return LinearModel(M, C, G, K, A, B, model.speed, model.spins[rows], model.state, labels)


@takes(speed=number("rad/s"), count=whole(1))
def torsional_modes(
    machine: Machine, speed: Any = 0.0, count: int | None = None, at: Any = "equilibrium"
) -> list[TorsionalMode]:
    """The torsional modes at `speed` (rad/s) by rising frequency, lateral and axial motion held, with the
    torque in every shaft: what Holzer's table lists, for branched and damped machines too.

    Raises `InputError` where nothing can twist, for a speed that is not finite, and for a `count` below
    1.

    Source: Holzer, Die Berechnung der Drehschwingungen (1921); Friswell et al. (2010), ch. 9.
    """
    check_linearized(at)
    machine.check()
    carriers = torque_carriers(machine)
    names = tuple(
        dict.fromkeys(signal for pair in carriers.values() for signal, _ in pair.values())
    )
    outputs = outputs_of(machine, coordinate_order(machine)[3], names)
    model, C = jax.tree.map(np.asarray, observed(machine, outputs, speed, at))
    twisting = torsional(model)
    values, shapes = lowest(twisting, count)
    n = model.M.shape[0]
    rows = [i for i, (_, c) in enumerate(model.coordinates) if c == "phi"]
    stations = [s for s, _ in twisting.coordinates]
    M = np.asarray(twisting.M)
    found = []
    for k, value in enumerate(values):
        shape = shapes[:, k]
        state = np.zeros(C.shape[1], complex)
        state[rows], state[[n + i for i in rows]] = shape, value * shape
        inside = np.asarray(twisting.A)[2 * len(rows) :]
        own = inside[:, 2 * len(rows) :]
        drive = inside[:, : 2 * len(rows)] @ np.concatenate([shape, value * shape])
        state[2 * n :] = np.linalg.solve(value * np.eye(len(own)) - own, drive)
        size = abs(value)
        seen = dict(zip(names, map(complex, C @ state)))
        torques, forces = (
            {
                name: factor * seen[signal]
                for name, pair in carriers.items()
                if what in pair
                for signal, factor in [pair[what]]
            }
            for what in ("torque", "force")
        )
        found.append(
            TorsionalMode(
                f"torsional {k + 1}",
                float(value.imag),
                float(-value.real / size),
                dict(zip(stations, map(complex, shape))),
                torques,
                dict(zip(stations, map(complex, size**2 * (M @ shape)))),
                forces,
            )
        )
    return found


def torque_carriers(machine: Machine) -> dict[str, dict[str, tuple[str, float]]]:
    """Of each shaft, coupling and gear the output and its factor that give the "torque" it carries, and of
    a gear the "force" in its teeth."""
    lineup = structure_of(machine)
    names = iter(lineup.wiring.connectors)
    found: dict[str, dict[str, tuple[str, float]]] = {}
    for block in lineup.connectors:
        one = block.one()
        offered = one.signals if isinstance(one, Signalling) else {}
        for _ in range(len(block)):
            name = next(names)
            if not isinstance(one, AbstractConnector):
                continue
            if "torque" in offered:
                found[name] = {"torque": (f"{name}.torque", 1.0)}
            elif "tooth_force" in offered:
                # the force ON the first wheel brakes it where it drives
                found[name] = {
                    "torque": (f"{name}.force.phi", -1.0),
                    "force": (f"{name}.tooth_force", 1.0),
                }
    return found


@takes()
def holzer_table(mode: TorsionalMode) -> str:
    """A mode as lines of text: station, angle, its inertia's torque; then the torque in each part, of a
    gear that upon its first wheel, and the force in its teeth. Raises `InputError` where `mode` is
    none."""
    w = mode.frequency
    lines = [f"{mode.name}: {w:.6g} rad/s, {w / (2 * np.pi):.6g} Hz"]
    width = max(map(len, ("station", *mode.angles, *mode.torques)))
    lines.append(f"{'station'.ljust(width)}  {'angle, rad':>12}  {'J w² angle, N·m':>16}")
    for name, angle in mode.angles.items():
        torque = mode.inertia_torques[name]
        lines.append(f"{name.ljust(width)}  {angle.real:12.6f}  {torque.real:16.6g}")
    teeth = f"  {'tooth force, N':>16}" if mode.tooth_forces else ""
    lines.append(f"{'between'.ljust(width)}  {'torque, N·m':>12}{teeth}")
    for name, t in mode.torques.items():
        force = mode.tooth_forces.get(name)
        own = "" if force is None else f"  {force.real:16.6g}"
        lines.append(f"{name.ljust(width)}  {t.real:12.6g}{own}")
    return "\n".join(lines)


@takes(orders=numbers(above=0.0), speeds=numbers("rad/s", fewest=2, rising=True), count=whole(1))
def interferences(
    machine: Machine,
    orders: Sequence[float],
    speeds: tuple[float, float],
    count: int | None = None,
    at: Any = "undeformed",
    shaft: str | None = None,
) -> list[Interference]:
    """Where the `orders` of excitation (periods in a turn) meet torsional frequencies, by rising speed.

    - `speeds`: the range (rad/s) in which the machine runs; the modes are those at its middle.
    - `shaft`: a station, by default the driven one. The turns that an order counts are those of its shaft,
      and all speeds are its own: behind gears another answer.
    - `count`: of the lowest modes that are looked at; by default all that some order can meet up to one and a
      half times the highest speed.

    Raises `InputError` for orders or speeds that are not positive, and where `shaft` is no station.
    """
    low, high = map(float, speeds)
    if not 0 < low <= high:
        raise InputError(f"speeds must be a positive range (low, high) in rad/s, but is {speeds!r}")
    if not all(order > 0 for order in orders):
        raise InputError(f"orders must be positive, but are {tuple(orders)!r}")
    found = []
    ratio = 1.0 if shaft is None else ratio_of(machine, shaft)
    for mode in torsional_modes(machine, 0.5 * (low + high) / ratio, count, at):
        if count is None and mode.frequency > _BEYOND * high * max(orders, default=0.0):
            continue
        for order in orders:
            speed = mode.frequency / order
            gap = max(1 - speed / low, speed / high - 1, 0.0)
            found.append(Interference(mode.name, float(order), speed, gap))
    return sorted(found, key=lambda f: f.speed)
