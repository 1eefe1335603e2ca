"""Steady running: the periodic whirl at a constant speed, by shooting over one turn."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..machine.field import jacobian, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import System, assemble
from .equilibrium import resting
from .exponential import ETD4RK
from .march import march
from .newton import newton_root
from .state import State, from_flat

# Steps of ETD4RK in one turn: speed * step = 0.025, an error near 1e-9 of the whirl.
_STEPS = 256
_ITERATIONS = 12
# Turns in which a mode that is damped at all has reached its whirl.
_ENDLESS = 1e9


def steady_whirl(
    machine: Machine, system: System, speed: Float[Array, ""]
) -> tuple[State, Array, Array]:
    """The state at t = 0 from which the machine, turning at `speed` (rad/s), comes back after a turn.

    All coordinates are measured from the turning line, in which a periodic whirl is a fixed point of
    the flow over one turn. Returns the state, its flat form (measured from the turning line), and the
    largest part of it that does not come back, relative to its size; inf where an undamped mode is excited at
    its own frequency.
    """
    A = jacobian(assemble(machine, nominal=True), speed)
    zero = jnp.zeros(())
    angle = system.reference(zero)[0]
    period = 2 * jnp.pi / jnp.abs(speed)
    knots = jnp.linspace(0.0, 1.0, 17) * period

    def field(t, y, system):
        return relative_field(t, y, system, (angle + speed * t, speed, jnp.zeros_like(t)))

    start = resting(system, (angle, zero, zero))
    solver, terms = ETD4RK(_STEPS // 16, A, None, n_free(system)), diffrax.ODETerm(field)
    prepared = solver.init(terms, knots[0], knots[1], start, system)
    jumps = jnp.zeros(knots.shape, bool)

    def turn(y):
        return march(solver, terms, knots, jumps, y, system, prepared)[-1]

    y = newton_root(lambda y: turn(y) - y, start, _ITERATIONS, 1e-11)
    n = n_free(system)
    push, gap = jnp.abs(jax.lax.map(lambda y: turn(y) - y, jnp.stack([start, y])))
    # displacements and speeds apart: their sizes differ by the speed
    missed = jnp.maximum(
        jnp.max(gap[:n]) / (jnp.max(jnp.abs(y[:n])) + 1e-12),
        jnp.max(gap[n : 2 * n]) / (jnp.max(jnp.abs(y[n : 2 * n])) + 1e-12 * jnp.abs(speed)),
    )
    # a whirl that is so much larger than what drives it in a turn is rounding
    endless = jnp.max(jnp.abs(y - start)[:n]) > _ENDLESS * jnp.max(push[:n])
    missed = jnp.where(endless, jnp.inf, missed)
    return from_flat(zero, y, system, (angle, speed, zero)), y, missed


@eqx.filter_jit
def steady(machine: Machine, speed: Float[Array, ""]) -> tuple[State, Array]:
    system = assemble(machine)
    state, _, missed = steady_whirl(machine, system, speed)
    return state, missed
