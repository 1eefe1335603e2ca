"""Where the machine rests under its weight."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import InputError
from ..gate import takes
from ..kinematics import COORDINATES
from ..machine.field import Reference, evaluate, initial_states, n_free
from ..machine.machine import Machine
from ..machine.system import System, assemble
from ..parameter import known, numbers
from .newton import newton_root
from .state import State, from_flat

_ITERATIONS = 25
# Near its wall a film stiffens faster than Newton's method converges.
_RUNNING_ITERATIONS = 100
# A spring that holds the common turning is stiffer than this part of the line's torsional stiffness.
_HELD = 1e-9


@takes()
def static_equilibrium(machine: Machine) -> State:
    """The machine at rest under gravity and constant loads at t = 0, by Newton's method.

    A spin that nothing holds (a torque-driven line) is held at its given angle. Differentiable.
    Raises `InputError` where some other motion is free under a load.
    """
    machine.check()
    state, rest = _equilibrium(machine)
    refuse_unbalanced(machine, rest)
    return state


@eqx.filter_jit
def _equilibrium(machine: Machine) -> tuple[State, Array]:
    system = assemble(machine)
    zero = jnp.zeros(())
    reference = (system.reference(zero)[0], zero, zero)
    y = resting(system, reference)
    return from_flat(zero, y, system, reference), unbalanced_loads(system, y, reference)


def resting(system: System, reference: Reference) -> Float[Array, " d"]:
    """The flat state of rest, measured from `reference`, whose speed must be zero."""
    n = n_free(system)
    z = initial_states(system)
    if n == 0:
        return z
    index = np.array(system.layout.free, dtype=int)

    def loads(u, system):
        y = jnp.concatenate([u, jnp.zeros(n), z])
        return evaluate(jnp.zeros(()), y, system, reference).loads.ravel()[index]

    held = _free_spin(loads, system)

    def missing(u):
        left = loads(u, system)
        return left if held is None else left - held * (held @ left) + held * (held @ u)

    u = newton_root(missing, jnp.zeros(n), _ITERATIONS, 1e-12)
    return jnp.concatenate([u, jnp.zeros(n), z])


def running(system: System, reference: Reference) -> Float[Array, " d"]:
    """Where the turning, balanced machine stays (`system` is its nominal one): no net load, internal states
    at rest. A free spin is left where it is."""
    n = n_free(system)
    z = initial_states(system)
    free = np.array(system.layout.free, int)
    zero = jnp.zeros(())

    def missing(x):
        y = jnp.concatenate([x[:n], jnp.zeros(n), x[n:]])
        ev = evaluate(zero, y, system, reference)
        return jnp.concatenate([ev.loads.ravel()[free], ev.rates])

    start = jnp.concatenate([jnp.zeros(n), z])
    x = newton_root(missing, start, _RUNNING_ITERATIONS, 1e-12) if start.size else start
    return jnp.concatenate([x[:n], jnp.zeros(n), x[n:]])


def _free_spin(loads, system: System) -> Array | None:
    """The common turning of a line that nothing leads, of length one over the free coordinates; zero where a
    spring holds it. Left to Newton's method, an unbalanced rotor would swing to its lowest place, from where
    its weight has no stiffness at all."""
    layout = system.layout
    free = np.array(layout.free, dtype=int)
    turning = (free // layout.n_mass == 5).astype(float)
    if system.ground or system.lead is not None or not turning.any():
        return None
    turn = 1.0 if system.turn is None else system.turn[free % layout.n_mass]
    held = turning * turn
    held = held / jnp.linalg.norm(held)
    light = eqx.tree_at(lambda s: s.gravity, system, jnp.zeros(3))
    _, push = jax.jvp(lambda u: loads(u, light), (jnp.zeros(free.size),), (held,))
    m = layout.n_nodes
    stiffest = jnp.max(jnp.abs(system.moving.reshape(6, m, 2, 6, m)[5, :, 0, 5]))
    return jax.lax.stop_gradient(jnp.where(jnp.max(jnp.abs(push)) <= _HELD * stiffest, held, 0.0))


def unbalanced_loads(system: System, y, reference: Reference) -> Float[Array, "n 6"]:
    """What is left of the loads on the free coordinates of each station, machine's order."""
    loads = evaluate(jnp.zeros(()), y, system, reference).loads
    free = np.zeros(loads.size)
    free[np.array(system.layout.free, dtype=int)] = 1.0
    loads = loads * free.reshape(loads.shape)
    grounded = jnp.concatenate([loads, jnp.zeros((6, system.layout.n_ground))], axis=1)
    return grounded.T[np.array(system.layout.internal)]


def refuse_unbalanced(machine: Machine, rest: Float[Array, "n 6"]) -> None:
    """Raises where something beside a free spin would start to move."""
    values = known(rest)
    if values is None:
        return
    left = np.abs(values)
    if not np.all(np.isfinite(left)):
        raise InputError(
            "no static equilibrium was found: Newton's method left the finite numbers; start from "
            'initial="undeformed"'
        )
    left[:, 5] = 0.0
    weight = 1e-6 * (1.0 + np.linalg.norm(numbers(machine.gravity)))
    station, coordinate = np.unravel_index(np.argmax(left), left.shape)
    if left[station, coordinate] > weight:
        unit = "N" if coordinate < 3 else "N*m"
        raise InputError(
            f"no static equilibrium: `{machine.wiring.stations[station]}` is free to move along "
            f"{COORDINATES[coordinate]} under a load of {left[station, coordinate]:.3g} {unit}: "
            'support it, fix that coordinate, or start from initial="running" (where it is carried once '
            'it turns, as by a film) or "undeformed"'
        )
