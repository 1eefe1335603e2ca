"""Which solver a machine runs by, and what its tolerances mean for each entry of the state."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .. import integrators
from ..core.protocol import NonSmooth
from ..machine.machine import Machine
from ..machine.sampling import machine_clocks
from ..machine.system import System


def is_smooth(machine: Machine) -> bool:
    """Whether no part of it, nor a law inside one, kinks, sticks or stiffens with its state."""
    parts = jax.tree.leaves(machine, is_leaf=lambda x: isinstance(x, NonSmooth))
    return not any(isinstance(part, NonSmooth) for part in parts)


def solver_for(machine: Machine, solver: Any) -> Any:
    """`solver`; where none is given, the one for stiff forces if the machine has such, else none."""
    return integrators.Rosenbrock() if solver is None and not is_smooth(machine) else solver


def is_planned(solver: Any) -> bool:
    """Whether a plan chooses its steps: those of the exponential solvers, one of which runs where none is
    given."""
    if solver is None:
        return True
    from ..integrators.exponential import AbstractExponential  # and diffrax with it

    return isinstance(solver, AbstractExponential)


def is_adams(solver: Any) -> bool:
    """Of one whose steps are planned: whether it is the default."""
    return solver is None or isinstance(solver, integrators.ExponentialAdams)


def may_span(solver: Any, machine: Machine) -> bool:
    """Whether a planned step may span several samples: one of the Adams method, where nothing ticks."""
    return is_adams(solver) and not machine_clocks(machine)


def tolerances(system: System, rtol: Any, atol: Any, extra: int = 0) -> tuple[Array, Array]:
    """Relative and absolute tolerance of each entry of the state; `extra` more entries follow it.

    The angle of a line that no drive leads grows for ever, so a share of it means nothing: `rtol` counts
    in rad there.
    """
    free = np.array(system.layout.free, int)
    n, states = free.size, system.n_states() + extra
    led = system.ground or any(
        m >= 0 for g in system.layout.stations for row in g.motions for m in row
    )
    angle = np.zeros(n) if led else (free // system.layout.n_mass == 5).astype(float)
    relative = jnp.concatenate([rtol * (1 - angle), jnp.full(n + states, rtol)])
    return relative, jnp.concatenate([atol + rtol * angle, jnp.full(n + states, atol)])
