"""The state from which a run starts."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..machine.field import initial_states, n_free
from ..machine.machine import Machine
from ..machine.system import System, assemble
from .equilibrium import resting, running
from .state import State, to_flat
from .steady import steady_whirl


def start(
    machine: Machine, system: System, initial: Any, speed: Any
) -> tuple[Float[Array, " d"], Array]:
    """The flat state at t = 0, and what to judge it by. `initial`, `speed`: as `Simulation` has them."""
    zero = jnp.zeros(())
    reference = system.reference(zero)
    n = n_free(system)
    if isinstance(initial, State):
        return to_flat(initial, system, reference), zero
    if initial == "steady":
        state, _, missed = steady_whirl(machine, system, speed)
        return to_flat(state, system, reference), missed
    checks = jnp.zeros((len(machine.wiring.stations), 6))
    if initial == "static":
        still = (reference[0], zero, zero)
        y, checks = resting(system, still)
    elif initial == "running":
        turning, balanced = (reference[0], speed, zero), assemble(machine, nominal=True)
        y, checks = running(balanced, turning)
    else:
        y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    free = jnp.array(system.layout.free, int)
    turn = 1.0 if system.turn is None else system.turn[free % system.layout.n_mass]
    spins = (free // system.layout.n_mass == 5) * turn * (speed - reference[1])
    return y.at[n : 2 * n].add(spins), checks
