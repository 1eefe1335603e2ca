"""Supports whose coefficients are no polynomial of the speed (tables, seals): taken apart from the machine,
and what they add to its matrices."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..core.kinematics import COORDINATES
from ..core.protocol import Inertial
from ..core.quick import quickly_compiled
from ..elements.bearings.annular_seal import AnnularSeal
from ..elements.bearings.labyrinth_seal import LabyrinthSeal
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..machine.machine import Machine
from .coordinates import coordinate_order
from .steady import Steady
from .whirling import at_whirl

# Those that do nothing about the axis, and those that a machine is taken apart from.
_SEALS = (AnnularSeal, LabyrinthSeal)
_APART = (SpeedDependentSupport, WhirlDependentSupport, *_SEALS)


class Tables(NamedTuple):
    """`rest`: the machine with supports that do nothing in the place of `parts`; where each of them stands:
    `places`, of its six coordinates among the free ones in the order of the vector field, -1 for what is
    held; `turning`: the station whose speed its table is over."""

    rest: Machine
    parts: tuple[SpeedDependentSupport | WhirlDependentSupport | AnnularSeal | LabyrinthSeal, ...]
    places: np.ndarray
    turning: np.ndarray

    @property
    def drag(self) -> bool:
        """Whether one answers to the spin itself, with a force on what lies straight."""
        return any(
            np.any(np.asarray(part.damping)[..., 5])
            for part in self.parts
            if not isinstance(part, _SEALS)
        )

    def at_whirl(self, frequency: float) -> "Tables":
        """With coefficients of the parts that depend on it at a whirl frequency, rad/s."""
        return self._replace(parts=tuple(at_whirl(part, frequency) for part in self.parts))

    def added(self, found: Steady) -> Steady:
        """To what is found of `rest` where it lies straight."""
        pull, M = found.at.pull.copy(), found.M.copy()
        A, B = self.added_to(found.at.A, found.at.B, found.at.state.velocity, pull, M)
        return found._replace(at=found.at._replace(A=A, B=B, pull=pull), M=M)

    def added_to(
        self,
        A: np.ndarray,
        B: np.ndarray,
        velocity: Any,
        pull: np.ndarray | None = None,
        M: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """A and B of the whole; `velocity` of the stations, (m, 6). `pull` and `M` are changed in place."""
        n, A = B.shape[1], A.copy()
        spins = np.asarray(velocity)[self.turning, 5]
        inertia = np.zeros((n, n))
        for place, slopes in zip(self.places, _slopes(self.parts, jax.device_put(spins))):
            free = np.flatnonzero(place >= 0)
            rows = place[free]
            for begin, slope in zip((0, n), np.asarray(slopes)):
                forces = slope[np.ix_(free, free)]
                A[:, begin + rows] += B[:, rows] @ forces
                if pull is not None:
                    pull[np.ix_(rows, begin + rows)] += forces
            inertia[np.ix_(rows, rows)] -= np.asarray(slopes)[2][np.ix_(free, free)]
        if not np.any(inertia):
            return A, B
        if M is not None:
            M += inertia
        # the force -E a, a = (I + B E)^-1 (A x + B F) in the rows of accelerations
        moving = np.flatnonzero(inertia.any(0) | inertia.any(1))
        E, fast = inertia[np.ix_(moving, moving)], n + moving
        share = E @ np.linalg.inv(np.eye(len(moving)) + B[np.ix_(fast, moving)] @ E)
        back = B[:, moving] @ share
        return A - back @ A[fast], B - back @ B[fast]


def tables_of(machine: Machine) -> Tables | None:
    """`None` where it has none, or holds one in a way of its own."""
    wiring, order, labels = machine.wiring, *coordinate_order(machine)[2:]
    elements = machine.elements()
    nothing = LinearSupport(jnp.zeros(6), jnp.zeros(6))
    names, places, turning = [], [], []
    for name, ends in zip(wiring.connectors, wiring.ends):
        if type(elements[name]) not in _APART:
            continue
        (station, port), *others = ends
        if port or others:
            return None
        own = [(wiring.stations[station], c) for c in COORDINATES]
        names.append(name)
        places.append([order[labels.index(x)] if x in labels else -1 for x in own])
        turning.append(station)
    if not names:
        return None
    parts: Any = tuple(elements[name] for name in names)
    rest = machine.set({name: nothing for name in names})
    return Tables(rest, parts, np.array(places), np.array(turning))


@quickly_compiled
def _slopes(parts: tuple[Any, ...], spins: Any) -> list[Any]:
    """Of each, how its forces change with its deflection, its velocity and its acceleration: (3, 6, 6)."""

    def of(part: Any, spin: Any) -> Any:
        def force(motion: Any) -> Any:
            return part.forces(jnp.zeros(()), (tuple(motion),), None)[0]

        there = jnp.zeros((2, 6)).at[1, 5].set(spin)
        slopes = jnp.moveaxis(jax.jacfwd(force)(there), 1, 0)
        inertia = None
        if isinstance(part, Inertial):
            inertia = part.inertia(jnp.zeros(()), (tuple(there),))
        inertia = jnp.zeros((6, 6)) if inertia is None else inertia
        return jnp.concatenate([slopes, -inertia[None]])

    return [of(part, spin) for part, spin in zip(parts, spins)]
