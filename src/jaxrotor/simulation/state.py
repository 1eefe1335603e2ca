"""The state of a machine as its user sees it: stations in the order of the machine."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import to_turning
from ..core.part import Part
from ..core.result_text import shows
from ..machine.field import Reference, initial_states, pack, station_motions, unpack
from ..machine.system import System


@shows()
class State(Part):
    """Coordinates and rates of every station, in the machine's order (`machine.wiring.stations`).

    - `position`: (n, 6), m and rad: x, y, z, psi, theta, phi.
    - `velocity`: (n, 6), m/s and rad/s.
    - `internal`: the elements' internal states, flat; `None` stands for their own initial ones.

    What is prescribed (a driven end, a fixed coordinate) is taken from the machine, not from here.
    """

    position: Float[Array, "n 6"]
    velocity: Float[Array, "n 6"]
    internal: Float[Array, " k"] | None = None


def to_flat(state: State, system: System, reference: Reference) -> Float[Array, " d"]:
    """The solver's state."""
    order = np.argsort(np.array(system.layout.internal))[: system.layout.n_mass]
    internal = initial_states(system) if state.internal is None else state.internal
    q, v = (jnp.asarray(x, float)[order].T for x in (state.position, state.velocity))
    if system.layout.invariant:
        q, v = to_turning(q, v)
    return pack(q, v, internal, system, reference)


def from_flat(t, y: Float[Array, " d"], system: System, reference: Reference) -> State:
    """The user's state at time `t`; driven ends included."""
    q, v = station_motions(t, y, system, reference)
    index = np.array(system.layout.internal)
    return State(q.T[index], v.T[index], unpack(t, y, system, reference)[2])
