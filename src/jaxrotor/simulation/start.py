"""The state from which a run starts."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..machine.field import initial_states, n_free
from ..machine.system import System
from .equilibrium import resting, running
from .state import State, to_flat
from .steady import steady_whirl


def start(
    system: System, balanced: System | None, initial: Any, speed: Any
) -> tuple[Float[Array, " d"], Array]:
    """The flat state at t = 0, and what to judge it by. `initial`, `speed`: as `Simulation` has them;
    `balanced`: the system without what turns with the shaft, where `needs_balanced` says so."""
    zero = jnp.zeros(())
    reference = system.reference(zero)
    n = n_free(system)
    if isinstance(initial, State):
        return to_flat(initial, system, reference), zero
    if initial == "steady":
        state, _, missed = steady_whirl(system, _known(balanced), speed)
        return to_flat(state, system, reference), missed
    checks = jnp.zeros((len(system.layout.internal), 6))
    if initial == "static":
        still = (reference[0], zero, zero)
        y, checks = resting(system, still)
    elif initial == "running":
        y, checks = running(_known(balanced), (reference[0], speed, zero))
    else:
        y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    free = jnp.array(system.layout.free, int)
    turn = 1.0 if system.turn is None else system.turn[free % system.layout.n_mass]
    spins = (free // system.layout.n_mass == 5) * turn * (speed - reference[1])
    return y.at[n : 2 * n].add(spins), checks


def needs_balanced(initial: Any) -> bool:
    return isinstance(initial, str) and initial in ("running", "steady")


def _known(balanced: System | None) -> System:
    assert balanced is not None
    return balanced
