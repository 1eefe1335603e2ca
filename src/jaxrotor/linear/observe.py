"""What can be observed of a machine, by name: coordinates, elements' own signals, forces."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..core.quick import quickly_compiled
from ..machine.field import Reference, initial_states, node_motions, unpack
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import System, assemble
from ..simulation.named_parts import forces_on_ends, part_of, signals_of
from .coordinates import coordinate_order, row_of

_UNITS = {c: "m" if c in "xyz" else "rad" for c in COORDINATES}
_FORCES = {c: "N" if c in "xyz" else "N*m" for c in COORDINATES}


class Output(NamedTuple):
    """`kind`: "coordinate" or "follower" (one of a station that follows others), "signal" or "force"; `what`:
    its name; `unit`: SI."""

    element: str
    kind: str
    what: str
    unit: str


def outputs_of(
    machine: Machine, labels: tuple[tuple[str, str], ...], given: tuple[str, ...]
) -> tuple[Output, ...]:
    """`"main.y"` a coordinate; `"shaft.torque"` a signal that an element offers; `"bearing.force.x"` the
    generalized force ON the first station of a shaft, coupling or support. Raises `InputError`."""
    wiring = structure_of(machine).wiring
    gone = wiring.condensation.followers if wiring.condensation else ()
    following = {wiring.stations[k] for k in gone}
    found = []
    for text in given:
        name, _, what = text.rpartition(".")
        if name.endswith(".force") and name[:-6] in wiring.connectors and what in COORDINATES:
            found.append(Output(name[:-6], "force", what, _FORCES[what]))
            continue
        signals = (
            signals_of(machine, name) if name in (*wiring.stations, *wiring.connectors) else {}
        )
        if name in following and what in COORDINATES:
            found.append(Output(name, "follower", what, _UNITS[what]))
        elif what in signals:
            found.append(Output(name, "signal", what, signals[what]))
        elif name in wiring.connectors:
            known = [*(f"{name}.{s}" for s in signals), f"{name}.force.x"]
            raise InputError(
                f"`{text}`: `{name}` offers no such quantity: take one of {', '.join(known)} (or y, z, "
                "psi, theta, phi)"
            )
        else:
            row_of(labels, text)
            found.append(Output(name, "coordinate", what, _UNITS[what]))
    return tuple(found)


def observe(
    machine: Machine, outputs: tuple[Output, ...], system: System, y, reference: Reference
) -> Float[Array, " n"]:
    """The outputs in a state `y` that is measured from `reference`."""
    zero = jnp.zeros(())
    # no accelerations: what is observed are motions, and what laws make of them
    N, V = node_motions(zero, y, system, reference)
    states = unpack(zero, y, system, reference)[2]
    stations = _station_nodes(system)
    names = structure_of(machine).wiring.stations
    found: list[Array] = []
    for output in outputs:
        if output.kind in ("coordinate", "follower"):
            place = stations[names.index(output.element)]
            found.append(N[COORDINATES.index(output.what), place])
            continue
        element, nodes, rows = part_of(machine, system, output.element)
        motions = tuple((N[:, i], V[:, i]) for i in nodes)
        state = states[rows] if rows.size else None
        if output.kind == "force":
            forces = forces_on_ends(element, zero, motions, state)
            found.append(forces[0, COORDINATES.index(output.what)])
        else:
            value = getattr(element, output.what)(zero, motions, state)
            if jnp.ndim(value):
                raise InputError(
                    f"`{output.element}.{output.what}`: is a vector: take one component of a force "
                    f"instead, such as {output.element}.force.x"
                )
            found.append(value)
    return jnp.stack(found)


def _station_nodes(system: System) -> list[int]:
    """The node that each station is, in the machine's order: behind all of those on stations with mass stand
    driven ends and followers."""
    layout = system.layout
    behind = layout.n_nodes - layout.n_mass
    return [k + behind * (k >= layout.n_mass) for k in layout.internal]


@quickly_compiled
def at_stations(machine: Machine, shape: Complex[Array, " n"]) -> Complex[Array, "m 6"]:
    """A shape over the free coordinates, in the order of a linear model's, at all stations: those that follow
    others too."""
    system = assemble(machine, nominal=True)
    order, zero = coordinate_order(machine)[2], jnp.zeros(())
    n = order.size
    y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])

    def nodes(u):
        reference = (system.reference(zero)[0], zero, zero)
        return node_motions(zero, y.at[order].set(u), system, reference)[0]

    parts = [jax.jvp(nodes, (jnp.zeros(n),), (x,))[1] for x in (shape.real, shape.imag)]
    return jax.lax.complex(*parts).T[np.array(_station_nodes(system))]


def at_coordinates(
    machine: Machine, reduced: Machine, shape: Complex[Array, " n"] | np.ndarray
) -> np.ndarray:
    """A shape of the reduced machine over the free coordinates of the machine itself, the largest entry 1."""
    at_all = np.asarray(at_stations(reduced, jnp.asarray(shape)))
    names = structure_of(machine).wiring.stations
    labels = coordinate_order(machine)[3]
    found = np.array([at_all[names.index(s), COORDINATES.index(c)] for s, c in labels])
    return found / found[np.argmax(np.abs(found))]


def sensitivity(
    machine: Machine, outputs: tuple[Output, ...], system: System, y, reference: Reference
) -> Float[Array, "n d"]:
    """d(outputs)/dy."""
    return jax.jacfwd(lambda y: observe(machine, outputs, system, y, reference))(y)


@quickly_compiled
def watched(
    machine: Machine, outputs: tuple[Output, ...], system: System, y, reference: Reference
) -> Float[Array, "n d"]:
    """`sensitivity`, once: where no derivative is asked."""
    return sensitivity(machine, outputs, system, y, reference)
