"""The balanced machine's matrices at many speeds: a few of them, and polynomials between, where the vector
field is a polynomial of the speed but for tables of supports."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..machine.field import n_free
from ..machine.machine import Machine
from ..simulation.state import State
from .degree import degree
from .instant import Prepared, field_and_loads, instant, prepare
from .steady import Steady, moved_by, steady
from .tables import Tables, tables_of

# Beyond this degree speeds are taken one by one; gyroscopic and centrifugal terms have 2.
MOST_DEGREE = 4
# Of what stands in a row, what polynomials may be off by; of the deflections, what a change of the speed may
# move the steady state by.
_SAME = 1e-12
_STILL = 1e-11


class Nodes(NamedTuple):
    """Speeds, rad/s, and what is known at each of them, a list of like trees of NumPy's arrays."""

    speeds: np.ndarray
    values: list[Any]

    def shares(self, speed: float) -> np.ndarray:
        """Lagrange's polynomials at a speed."""
        gaps = self.speeds[:, None] - self.speeds
        np.fill_diagonal(gaps, 1.0)
        away = np.broadcast_to(speed - self.speeds, gaps.shape).copy()
        np.fill_diagonal(away, 1.0)
        return np.prod(away / gaps, axis=1)

    def at(self, speed: float, part: Callable[[Any], Any] = lambda x: x) -> Any:
        """The polynomial through (some part of) the values."""
        shares = self.shares(speed)
        return jax.tree.map(
            lambda *x: sum(share * each for share, each in zip(shares, x)),
            *map(part, self.values),
        )


def nodes_of(speeds: np.ndarray, most: float) -> np.ndarray:
    """Speeds through which a polynomial of degree `most` is drawn, well apart in the range of `speeds`."""
    count = int(most) + 1
    turns = np.cos(np.pi * (np.arange(count)[::-1] + 0.5) / count)
    return 0.5 * (speeds.max() + speeds.min()) + 0.5 * np.ptp(speeds) * turns


class OverSpeed:
    """`Steady` at any of `speeds`, rad/s; `at` as for `linearize`."""

    def __init__(
        self, machine: Machine, speeds: np.ndarray, at: Any, prepared: Prepared | None = None
    ):
        self.machine, self.mode, self._prepared = machine, at, prepared
        self.nodes: Nodes | None = None
        self.degree = np.inf  # of rates and loads, and of the forces from outside that hold it
        self.tables: Tables | None = None
        if isinstance(at, State) or not np.ptp(speeds) > 0:
            return
        speeds = np.asarray(speeds, float)
        tables = tables_of(machine)
        if tables is None:
            self._look(speeds)
            return
        rest = OverSpeed(tables.rest, speeds, "undeformed")
        if rest.nodes is None:
            return
        if at == "undeformed" or (not tables.drag and _straight(rest.nodes)):
            self.nodes, self.degree, self.tables = rest.nodes, rest.degree, tables

    @property
    def prepared(self) -> Prepared:
        if self._prepared is None:
            self._prepared = prepare(self.machine)
        return self._prepared

    def _look(self, speeds: np.ndarray) -> None:
        most = _degree(self.prepared, 0.0)
        most = _degree(self.prepared, most) if most <= MOST_DEGREE else np.inf
        if not (most <= MOST_DEGREE and len(speeds) > most + 2):
            return
        where = nodes_of(speeds, most)
        first = steady(self.prepared, float(where[0]), self.mode)
        found = [first]
        for speed in where[1:]:
            there = self._beside(first, float(speed))
            if there is None:
                return
            found.append(there)
        nodes = Nodes(where, found)
        # a test of what the program says, at a speed of its own
        speed = float(0.77 * where[0] + 0.23 * where[1])
        there = self._beside(first, speed)
        if there is None or not _alike(nodes.at(speed, _matrix), _matrix(there)):
            return
        if any(not _alike(x.M, first.M) for x in found):
            return
        self.nodes, self.degree = nodes, float(most)

    def _beside(self, first: Steady, speed: float) -> Steady | None:
        """At another speed, where the same state is steady there, else `None`."""
        if self.mode != "equilibrium":
            return steady(self.prepared, speed, self.mode)
        found = instant(self.prepared, first.y, speed)
        if moved_by(self.prepared, first.y, found) > _STILL * np.abs(first.y).max(initial=0.0):
            return None
        return steady(self.prepared, speed, self.mode, (first.y, found))

    def __call__(self, speed: float, part: Callable[[Steady], Any] = lambda x: x) -> Any:
        """`Steady`, or a part of it."""
        if self.nodes is not None and self.tables is not None:
            return part(self.tables.added(self.nodes.at(speed)))
        if self.nodes is not None:
            return self.nodes.at(speed, part)
        return part(steady(self.prepared, speed, self.mode))

    def rates(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """A and B alone, sooner."""
        if self.nodes is None or self.tables is None:
            return self(speed, lambda x: (x.at.A, x.at.B))
        A, B, velocity = self.nodes.at(speed, lambda x: (x.at.A, x.at.B, x.at.state.velocity))
        return self.tables.added_to(A, B, velocity)


def _straight(nodes: Nodes) -> bool:
    """Whether nothing bends the machine at any speed: then where it is undeformed it is in balance."""
    return all(
        not np.any(x.at.loads) and not np.any(x.held) and not np.any(x.y) for x in nodes.values
    )


def _matrix(found: Steady) -> np.ndarray:
    return found.at.A


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.all(np.abs(a - b).max(1) <= _SAME * np.abs(b).sum(1)))


def _degree(prepared: Prepared, forced: float) -> float:
    """Of rates and loads in the speed, under forces of a degree of their own."""

    def found(prepared, speed, force):
        reference = (prepared.angle, speed, jnp.zeros(()))
        return field_and_loads(prepared.system, prepared.start, reference, force)

    given = (prepared, jnp.ones(()), jnp.zeros(n_free(prepared.system)))
    return degree(found, given, (0.0, 1.0, forced))
