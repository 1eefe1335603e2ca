"""How much a machine weighs, and how much there is to spin up."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.gate import takes
from ..core.protocol import AbstractInertia, Carried, is_massive
from ..core.quick import lightly_compiled
from ..machine.lineup import Block, line_up
from ..machine.machine import Machine


@takes()
def total_mass(machine: Machine) -> Float[Array, ""]:
    """Mass of all that moves with the line, kg: rotors, bodies, bearings with housing and lumped shaft, added
    masses, shafts with mass of their own.

    Twice the kinetic energy of a unit speed along x, by the elements' own account of it, so that a class of
    your own counts too; fixed coordinates do not matter. Driven ends have no mass; a `Shaft` has what its
    bearings lump of it. Raises `InputError` where `machine` is none.
    """
    return _inertia(machine, 0)


@takes()
def polar_inertia(machine: Machine) -> Float[Array, ""]:
    """Inertia about the axis, kg·m², unbalance included: twice the kinetic energy of a unit speed of all
    stations in phi.

    Each station at its own speed, as if there were no gears. What turns on a state of its own (the ring of
    a `TorsionalDamper`) is not counted. Raises `InputError` where `machine` is none.
    """
    return _inertia(machine, 5)


@lightly_compiled
def _inertia(machine: Machine, coordinate: int) -> Array:
    rest, moving = jnp.zeros(6), jnp.zeros(6).at[coordinate].set(1.0)
    lineup = line_up(machine)
    total, first = jnp.zeros(()), 0
    for block in lineup.stations:
        if isinstance(block.element, (AbstractInertia, Carried)):
            total += _sum(block, lambda e: e.kinetic_energy(rest, moving))
    for block in lineup.connectors:
        if is_massive(block.one()) and block.element.weighs:
            motions = ((rest, moving),) * len(lineup.wiring.ends[first])
            total += _sum(block, lambda e, motions=motions: e.kinetic_energy(motions))
        first += len(block)
    return 2 * total


def _sum(block: Block, energy) -> Array:
    if block.count is None:
        return energy(block.element)
    return jnp.sum(jax.vmap(energy, in_axes=-1, axis_size=block.count)(block.element))
