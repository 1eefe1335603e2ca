"""Steady running: the periodic whirl at a constant speed, by shooting over one turn."""

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.quick import quickly_compiled
from ..integrators.exponential import ETD4RK
from ..integrators.march import march
from ..integrators.newton import newton_root
from ..integrators.step_times import knots
from ..machine.field import jacobian, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import System, assemble_both
from .equilibrium import resting
from .state import State, from_flat

# Steps of ETD4RK in one turn: speed * step = 0.025, an error near 1e-9 of the whirl.
_STEPS = 256
_ITERATIONS = 12
# A whirl so many times what a turn adds to the resting line is no whirl: damping (1e-10 critical) is missing.
_RESONANCE = 1e9


def steady_whirl(
    system: System, balanced: System, speed: Float[Array, ""]
) -> tuple[State, Array, Array]:
    """The state at t = 0 from which the system, turning at `speed` (rad/s), comes back after a turn.

    All coordinates are measured from the turning line, in which a periodic whirl is a fixed point of
    the flow over one turn. Returns the state, its flat form (measured from the turning line), and the
    largest part of it that does not come back, relative to its size; infinite in an undamped resonance.
    """
    A = jacobian(balanced, speed)
    zero = jnp.zeros(())
    angle = system.reference(zero)[0]
    period = 2 * jnp.pi / jnp.abs(speed)
    at = knots(jnp.linspace(0.0, 1.0, 17) * period, jnp.zeros(0))

    def field(t, y, system):
        return relative_field(t, y, system, (angle + speed * t, speed, jnp.zeros_like(t)))

    start, _ = resting(system, (angle, zero, zero))
    solver, terms = ETD4RK(_STEPS // 16, A, None, n_free(system)), diffrax.ODETerm(field)
    prepared = solver.init(terms, at.times[0], at.times[1], start, system)

    def turn(y):
        return march(solver, terms, at, y, system, prepared)[-1]

    y = newton_root(lambda y: turn(y) - y, start, _ITERATIONS, 1e-11).x
    n = n_free(system)
    # one program for both: what does not come back, and what a turn adds to the resting line
    gap, gain = jnp.abs(jax.lax.map(lambda y: turn(y) - y, jnp.stack([y, start])))
    # displacements and speeds apart: their sizes differ by the speed
    missed = jnp.maximum(
        jnp.max(gap[:n]) / (jnp.max(jnp.abs(y[:n])) + 1e-12),
        jnp.max(gap[n : 2 * n]) / (jnp.max(jnp.abs(y[n : 2 * n])) + 1e-12 * jnp.abs(speed)),
    )
    grown = jnp.max(jnp.abs(y - start)[:n]) > _RESONANCE * jnp.max(gain[:n], initial=1e-30)
    missed = jnp.where(grown, jnp.inf, missed)
    return from_flat(zero, y, system, (angle, speed, zero)), y, missed


@quickly_compiled
def steady(machine: Machine, speed: Float[Array, ""]) -> tuple[State, Array]:
    system, balanced = assemble_both(machine)
    state, _, missed = steady_whirl(system, balanced, speed)
    return state, missed
