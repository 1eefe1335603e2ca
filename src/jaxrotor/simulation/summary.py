"""What a machine weighs, where, and what carries it at rest."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..core.parameter import is_concrete
from ..core.protocol import AbstractAttachment, AbstractInertia, Acting, Carried, Linear, is_massive
from ..core.quick import lightly_compiled, quickly_compiled
from ..core.readable import amount
from ..machine.axial import axial_positions, port_offset
from ..machine.field import evaluate
from ..machine.lineup import line_up, structure_of
from ..machine.machine import Machine
from ..machine.system import assemble
from .equilibrium import refuse_unbalanced, resting
from .named_parts import forces_on_ends, part_of

# What is smaller than this part of the largest of its kind is not shown.
_NOTHING = 1e-6


class PartSummary(NamedTuple):
    """Of one part: `mass` (kg), `polar_inertia` about the axis and `transverse_inertia` about a line along y
    through its own mass centre (kg·m²), `length` (m; None where it has none), `position` of its mass centre
    along the axis from the machine's left end (m)."""

    name: str
    kind: str
    mass: float
    polar_inertia: float
    transverse_inertia: float
    length: float | None
    position: float


@dataclasses.dataclass(frozen=True)
class MachineSummary:
    """`print(summary)` shows it as tables.

    - `parts`: a `PartSummary` of each part that has mass or length. A `Shaft` without mass of its own weighs
      what its bearings have lumped of it.
    - `mass`: kg, of all. `centre_of_gravity`: m along the axis from the left end.
    - `weight`: (3,), N.
    - `reactions`: name -> (6,), N and N·m: the generalized force ON the machine at rest under gravity and
      what acts at t = 0, of each support, load, and station with held coordinates (`"main (held)"`), by
      `static_equilibrium`. Their forces and the weight add up to zero.
    - `no_rest`: why there are none, where the machine has no static equilibrium; else empty.
    """

    parts: tuple[PartSummary, ...]
    mass: float
    centre_of_gravity: float
    weight: np.ndarray
    reactions: dict[str, np.ndarray]
    no_rest: str = ""

    def __str__(self) -> str:
        lines = _table(self._masses())
        if self.no_rest:
            return "\n".join([*lines, "", f"! {self.no_rest}"])
        if not self.reactions:
            return "\n".join(lines)
        return "\n".join([*lines, "", *_table(self._forces())])

    __repr__ = __str__

    def _masses(self) -> list[list[str]]:
        rows = [["part", "kind", "mass", "polar inertia", "transverse inertia", "length", "at z"]]
        for part in self.parts:
            inertias = (part.polar_inertia, part.transverse_inertia)
            masses = [_short(part.mass, "kg"), *(_short(x, "kg*m^2") for x in inertias)]
            length = "" if part.length is None else _short(part.length, "m")
            masses = masses if part.mass else [""] * 3
            rows.append([part.name, part.kind, *masses, length, _short(part.position, "m")])
        centre = _short(self.centre_of_gravity, "m")
        return [*rows, ["all", "", _short(self.mass, "kg"), "", "", "", centre]]

    def _forces(self) -> list[list[str]]:
        titles = [f"{'F' if c in 'xyz' else 'M'} {c}" for c in COORDINATES]
        rows = [["on the machine, at rest", *titles]]
        units = ["N"] * 3 + ["N*m"] * 3
        sizes = np.abs(np.stack(list(self.reactions.values()))).reshape(-1, 2, 3)
        least = _NOTHING * np.repeat(sizes.max(axis=(0, 2)), 3)  # of forces, of moments
        shown = self.reactions | {"weight": np.append(self.weight, np.zeros(3))}
        for name, force in shown.items():
            entries = zip(force, units, least)
            texts = [_short(f, u) if abs(f) > x else "" for f, u, x in entries]
            if any(texts):
                rows.append([name, *texts])
        return rows


def _short(value: float, unit: str) -> str:
    return amount(value, unit, 5)


def _table(rows: list[list[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows)]
    first = widths.pop(0)
    return [
        "  ".join([row[0].ljust(first), *map(str.rjust, row[1:], widths)]).rstrip() for row in rows
    ]


def summarize(machine: Machine) -> MachineSummary:
    """Raises `InputError` for parameters out of their bounds and for numbers that are traced."""
    machine.check()
    if not all(is_concrete(x) for x in jax.tree.leaves(machine)):
        raise InputError(
            "a summary needs known numbers, but parameters of this machine are traced: ask for it outside of "
            "jit and vmap"
        )
    inertias, left, forces = jax.tree.map(np.asarray, _at_rest(machine))
    parts = _parts(machine, inertias)
    mass = sum(part.mass for part in parts)
    centre = sum(part.mass * part.position for part in parts) / mass if mass else 0.0
    weight = mass * np.asarray(machine.gravity)
    try:
        refuse_unbalanced(machine, left)
    except InputError as error:
        return MachineSummary(parts, mass, centre, weight, {}, str(error))
    return MachineSummary(
        parts, mass, centre, weight, {name: f for name, f in forces.items() if f.any()}
    )


@lightly_compiled
def _at_rest(machine: Machine) -> tuple[dict[str, Array], Array, dict[str, Array]]:
    """Mass matrices by name of all parts (stations, 6x6), what equilibrium leaves, forces of the ground."""
    system = assemble(machine)
    layout = system.layout
    inertias = _inertias(machine)
    zero = jnp.zeros(())
    reference = (system.reference(zero)[0], zero, zero)
    y, left = resting(system, reference)
    at = evaluate(zero, y, system, reference)
    q, v = at.nodes
    forces = {}
    for name, element in machine.elements().items():
        grounded = isinstance(element, AbstractAttachment) or name in machine.wiring.stations
        if grounded and isinstance(element, (Acting, Linear)):
            element, nodes, states = part_of(machine, system, name)
            motions = tuple((q[:, i], v[:, i]) for i in nodes)
            state = at.states[states] if states.size else None
            forces[name] = jnp.sum(forces_on_ends(element, zero, motions, state), axis=0)
    reaction = at.reaction.T[np.array(layout.internal)]
    for i, name in enumerate(machine.wiring.stations[: len(machine.stations)]):
        forces[f"{name} (held)"] = reaction[i]
    return inertias, left, forces


def _inertias(machine: Machine) -> dict[str, Array]:
    """Mass matrices by name of all parts (stations, 6x6)."""
    lineup = line_up(machine)
    wiring = lineup.wiring
    names, inertias = iter(wiring.stations), {}
    rest = jnp.zeros(6)
    for block in lineup.stations:
        own = [next(names) for _ in range(len(block))]
        if isinstance(block.element, (AbstractInertia, Carried)):
            hessian = _each(block, lambda e: jax.hessian(lambda v: e.kinetic_energy(rest, v))(rest))
            inertias |= dict(zip(own, hessian))
    names = iter(wiring.connectors)
    for block in lineup.connectors:
        own = [next(names) for _ in range(len(block))]
        if is_massive(block.one()) and block.element.weighs:
            inertias |= dict(zip(own, _each(block, lambda e: e.mass_matrix())))
    return inertias


_inertias_alone = quickly_compiled(_inertias)


def parts_with_mass(machine: Machine) -> tuple[PartSummary, ...]:
    """The parts alone of `summarize`: no equilibrium is looked for."""
    return _parts(machine, jax.tree.map(np.asarray, _inertias_alone(machine)))


def _each(block, function) -> list[Array]:
    if block.count is None:
        return [function(block.element)]
    found = jax.vmap(function, in_axes=-1, axis_size=block.count)(block.element)
    return [found[k] for k in range(block.count)]


def _parts(machine: Machine, inertias: dict[str, np.ndarray]) -> tuple[PartSummary, ...]:
    where = axial_positions(machine)
    wiring = structure_of(machine).wiring
    places = {name: [where[name]] for name in wiring.stations}
    for known in (machine.wiring, wiring):  # composites as a whole, and their elements
        for name, ends in zip(known.connectors, known.ends):
            places[name] = [
                where[wiring.stations[s]] + port_offset(machine, s, port) for s, port in ends
            ]
    found = []
    for name, element in machine.elements().items():
        own = [n for n in inertias if n == name or n.startswith(f"{name}.")]
        # mass, its first and second moment along the axis, polar inertia
        moments = sum((_moments(inertias[n], places[n]) for n in own), np.zeros(4))
        mass, first, second, polar = map(float, moments)
        length = getattr(element, "length", None)
        if isinstance(element, AbstractAttachment):
            length = None  # of a bearing's film: nothing along the line
        if mass or length is not None:
            centre = first / mass if mass else float(np.mean(places[name]))
            total = None if length is None else float(np.sum(np.asarray(length)))
            across = second - mass * centre**2
            found.append(
                PartSummary(name, type(element).__name__, mass, polar, across, total, centre)
            )
    return tuple(found)


def _moments(matrix: np.ndarray, places: list[float]) -> np.ndarray:
    """Of a consistent mass matrix over stations at `places`: of rigid motions, which it holds exactly."""
    along, tilting, turning = (np.zeros((len(places), 6)) for _ in range(3))
    along[:, 0], turning[:, 5] = 1.0, 1.0
    tilting[:, 0], tilting[:, 4] = places, 1.0  # dx/dz = +theta
    a, b, c = (x.ravel() for x in (along, tilting, turning))
    return np.array([a @ matrix @ a, a @ matrix @ b, b @ matrix @ b, c @ matrix @ c])
