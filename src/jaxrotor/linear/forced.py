"""The vibration that what turns with the shaft makes, order by order, as numbers: matrices and forces are
taken from the vector field at a few speeds where both are polynomials of the speed, else at each."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..core.bar import with_bar
from ..core.quick import quickly_compiled
from ..core.threads import one_thread
from ..machine.field import on_nodes
from ..machine.machine import Machine
from ..machine.system import System
from .coordinates import coordinate_order
from .degree import degree
from .excess import excess
from .instant import Prepared, prepare_both
from .observe import Output, observe, watched
from .over_speed import MOST_DEGREE, Nodes, OverSpeed, nodes_of
from .poles import beside_poles_numbers, poles_of
from .resolvent import resolved, resolvent
from .steady import Steady


class _Excited(NamedTuple):
    """At one speed, complex: `forces` (orders, d) on the rates and `direct` (orders, m) in the outputs;
    and `C` (m, d), what turns a state into outputs."""

    forces: np.ndarray
    direct: np.ndarray
    C: np.ndarray


class _Turning:
    """What turns with the shaft, over speed."""

    def __init__(
        self, machine, balanced, actual: System, prepared: Prepared, outputs, angles, waves
    ):
        self.pair = (machine, actual), (balanced, prepared.system)
        self.prepared, self.angles, self.waves = prepared, jnp.asarray(angles), waves
        order, labels = coordinate_order(machine)[2:]
        self.rows = None
        if all(output.kind == "coordinate" for output in outputs):
            rows = [labels.index((o.element, o.what)) for o in outputs]
            self.rows, outputs = np.asarray(order)[rows], ()
        self.outputs: tuple[Output, ...] = outputs

    def at(self, found: Steady, speed: float) -> _Excited:
        y, at, held = jax.device_put((found.y, np.float64(speed), found.held))
        forces, direct = _turned(self.pair, self.outputs, y, at, held, self.angles)
        forces, direct = self.waves @ np.asarray(forces), self.waves @ np.asarray(direct)
        if self.rows is not None:
            C = np.eye(len(found.y))[self.rows]
            return _Excited(forces, np.zeros((len(forces), len(C))), C)
        (_, (balanced, nominal)) = self.pair
        reference = (self.prepared.angle, at, jnp.zeros(()))
        C = watched(balanced, self.outputs, nominal, y, reference)
        return _Excited(forces, direct, np.asarray(C))

    def degree(self, forced: float) -> float:
        """In the speed, where the state is the same at all and `held` is of a degree of its own."""
        (_, (balanced, nominal)) = self.pair

        def found(pair, y, speed, held, angle):
            out = excess(
                pair, self.outputs, y, (angle, speed, 0.0 * angle), on_nodes(nominal, held)
            )
            if not self.outputs:
                return out
            return out, observe(balanced, self.outputs, nominal, y, (angle, speed, 0.0 * angle))

        n = len(self.prepared.system.layout.free)
        one = jnp.ones(())
        told = degree(
            found, (self.pair, self.prepared.start, one, jnp.zeros(n), one), (0, 0, 1, forced, 0)
        )
        return max(jax.tree.leaves(told), default=0.0)


@one_thread
def amplitudes(
    machine: Machine,
    balanced: Machine,
    outputs: tuple[Output, ...],
    speeds: Any,
    orders: tuple[float, ...],
    turn_at: int | None,
    at: Any,
    angles: np.ndarray,
) -> np.ndarray:
    """(speed, order, output), complex. `turn_at`: the station whose turns are counted, else the reference's;
    `angles`: of its shaft, over which the forces are told apart by order."""
    prepared, actual = prepare_both(machine)
    turn = 1.0 if turn_at is None else float(np.asarray(prepared.system.turns())[turn_at])
    waves = 2 / angles.size * np.exp(-1j * np.asarray(orders)[:, None] * angles)
    speeds = np.asarray(speeds)
    over = OverSpeed(machine, speeds, at, prepared)
    turning = _Turning(machine, balanced, actual, prepared, outputs, angles / turn, waves)
    nodes = None
    if over.nodes is not None and (most := turning.degree(over.degree)) <= MOST_DEGREE:
        where = nodes_of(speeds, most)
        nodes = Nodes(where, [turning.at(over(float(w)), float(w)) for w in where])
    found = []
    for speed in map(float, with_bar(speeds, "response")):
        if nodes is not None:
            A, excited = over.rates(speed)[0], nodes.at(speed)
        else:
            there = over(speed)
            A, excited = there.at.A, turning.at(there, speed)
        M = over.nodes.values[0].M if over.nodes is not None else there.M
        found.append(
            [_order(A, M, excited, k, order * turn * speed) for k, order in enumerate(orders)]
        )
    return np.array(found).reshape(len(speeds), len(orders), len(outputs))


def _order(A: np.ndarray, M: np.ndarray, excited: _Excited, k: int, w: float) -> np.ndarray:
    n, force = len(M), excited.forces[k]
    whirl, near = resolved(A, n, w, force)
    if not near:
        return excited.C @ whirl + excited.direct[k]
    found = beside_poles_numbers(lambda s: excited.C @ resolvent(A, n, s, force), poles_of(A, M), w)
    return found + excited.direct[k]


@quickly_compiled
def _turned(pair, outputs, y, speed, held, angles):
    system = pair[1][1]
    applied = on_nodes(system, held)
    # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
    return jax.lax.map(
        lambda angle: excess(pair, outputs, y, (angle, speed, jnp.zeros(())), applied), angles
    )
