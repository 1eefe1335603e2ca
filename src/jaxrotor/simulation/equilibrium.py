"""Where the machine rests under its weight."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import known, numbers
from ..core.protocol import Settling
from ..core.quick import quickly_compiled
from ..integrators.newton import newton_root
from ..machine.field import Reference, initial_states, n_free, net_loads
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import System
from .assembling import system_of
from .free_turning import turning_at_rest
from .state import State, from_flat

# Near its wall a film stiffens faster than Newton's method converges; towards the root of a cubic law it
# gains a third of the way in each step.
_ITERATIONS = 100


@takes()
def static_equilibrium(machine: Machine) -> State:
    """The machine at rest under gravity and constant loads at t = 0, by Newton's method.

    A spin that nothing holds (a torque-driven line) is held at its given angle. Differentiable.
    Raises `InputError` where some other motion is free under a load.
    """
    machine.check()
    state, rest = _equilibrium(system_of(machine))
    refuse_unbalanced(machine, rest)
    return state


@quickly_compiled
def _equilibrium(system: System) -> tuple[State, Array]:
    zero = jnp.zeros(())
    reference = (system.reference(zero)[0], zero, zero)
    y, left = resting(system, reference)
    return from_flat(zero, y, system, reference), left


def resting(system: System, reference: Reference) -> tuple[Float[Array, " d"], Float[Array, "n 6"]]:
    """The flat state of rest, measured from `reference`, whose speed must be zero; and what is left of the
    loads on the free coordinates of each station (machine's order), but for the common torque of each free
    line."""
    n, z = n_free(system), initial_states(system)
    moved = settling_states(system)

    def flat(x):
        return jnp.concatenate([x[:n], jnp.zeros(n), z.at[moved].set(x[n:]) if moved.size else z])

    def loads(x):
        left, rates = net_loads(flat(x), system, reference)
        return jnp.concatenate([left, rates[moved]]) if moved.size else left

    x, left = _balanced(loads, jnp.concatenate([jnp.zeros(n), z[moved]]), system)
    return flat(x), left


def settling_states(system: System) -> np.ndarray:
    """Which of the internal states rest with the machine (`Settling`)."""
    rows = [np.arange(*a.states) for a in system.actors if isinstance(a.element, Settling)]
    return np.concatenate([np.zeros(0, int), *rows])


def running(system: System, reference: Reference) -> tuple[Float[Array, " d"], Float[Array, "n 6"]]:
    """Where the turning, balanced machine stays (`system` is its nominal one): no net load, internal states
    at rest. A free spin is left where it is. What is left of the loads as from `resting`."""
    n, z = n_free(system), initial_states(system)

    def loads(x):
        y = jnp.concatenate([x[:n], jnp.zeros(n), x[n:]])
        return jnp.concatenate(net_loads(y, system, reference))

    x, left = _balanced(loads, jnp.concatenate([jnp.zeros(n), z]), system)
    return jnp.concatenate([x[:n], jnp.zeros(n), x[n:]]), left


def _balanced(
    loads: Callable[[Array], Array], start: Array, system: System
) -> tuple[Array, Float[Array, "n 6"]]:
    """Where the loads vanish, a free line's common turning held where it is in place of its common torque.
    Left to Newton's method, an unbalanced rotor would swing to its lowest place, from where its weight has no
    stiffness at all."""
    layout, n = system.layout, n_free(system)
    turning = turning_at_rest(system)

    def missing(x):
        left = loads(x)
        if turning is None:
            return left
        return left.at[:n].add(turning.free @ (x[:n] - left[:n]))

    farther = None
    if turning is not None:
        more = start.size - n
        farther = turning.free @ turning.farther - turning.farther
        farther = jnp.pad(farther, ((0, more), (0, more)))
    x, left = start, jnp.zeros(0)
    if start.size:
        x, left = newton_root(missing, start, _ITERATIONS, 1e-12, farther)
    left = left[:n]
    grounded = jnp.zeros(6 * layout.n_mass).at[np.array(layout.free, int)].set(left)
    grounded = jnp.pad(grounded.reshape(6, -1), ((0, 0), (0, layout.n_ground + layout.n_followers)))
    return x, grounded.T[np.array(layout.internal)]


def refuse_unbalanced(machine: Machine, rest: Float[Array, "n 6"]) -> None:
    """Raises where something beside a free line's common turning would start to move."""
    values = known(rest)
    if values is None:
        return
    left = np.abs(values)
    if not np.all(np.isfinite(left)):
        raise ConvergenceError(
            "no static equilibrium was found: Newton's method left the finite numbers; start from "
            'initial="undeformed"'
        )
    weight = 1e-6 * (1.0 + np.linalg.norm(numbers(machine.gravity)))
    station, coordinate = np.unravel_index(np.argmax(left), left.shape)
    if left[station, coordinate] > weight:
        if coordinate == 5:
            raise InputError(_unbalanced_torque(machine, int(station), values))
        unit = "N" if coordinate < 3 else "N*m"
        raise InputError(
            f"no static equilibrium: `{machine.wiring.stations[station]}` is free to move along "
            f"{COORDINATES[coordinate]} under a load of {left[station, coordinate]:.3g} {unit}: "
            'support it, fix that coordinate, or start from initial="running" (where it is carried once '
            'it turns, as by a film) or "undeformed"'
        )


def _unbalanced_torque(machine: Machine, station: int, left: np.ndarray) -> str:
    wiring = structure_of(machine).wiring
    beside = [
        f"`{name}`" for name, ends in zip(wiring.connectors, wiring.ends)
        if len(ends) > 1 and any(s == station for s, _ in ends)
    ]  # fmt: skip
    return (
        f"no static equilibrium: at rest {left[station, 5]:.3g} N*m about the axis are left on "
        f"`{wiring.stations[station]}`, which {' and '.join(beside) or 'nothing'} must carry, "
        'but cannot; check what joins it, take the load off at t = 0, or start from initial="undeformed"'
    )
