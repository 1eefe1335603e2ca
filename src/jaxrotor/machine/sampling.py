"""States that change at instants alone: what sampling elements do when their clocks tick."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..core.protocol import Sampled
from .field import n_free, node_motions
from .machine import Machine
from .system import System


class Clock(NamedTuple):
    """Clock `which` of the stacked elements `actor`: it ticks every `period` s from `first` on."""

    actor: int
    which: int
    period: float
    first: float


def machine_clocks(machine: Machine) -> list[tuple[str, float, float]]:
    """(name, period, first) of every clock of a machine."""
    return [
        (name, period, first)
        for name, element in machine.elements().items()
        if isinstance(element, Sampled)
        for period, first in element.clocks()
    ]


def clocks_of(system: System) -> list[Clock]:
    """In the order in which they tick at the same instant: sampling comes before setting."""
    found = [
        Clock(i, which, *clock)
        for i, actor in enumerate(system.actors)
        if isinstance(actor.element, Sampled)
        for which, clock in enumerate(actor.element.clocks())
    ]
    return sorted(found, key=lambda clock: clock.which)


def ticked(
    t: Float[Array, ""], y: Float[Array, " d"], system: System, due: Bool[Array, " clocks"]
) -> Float[Array, " d"]:
    """The state behind the instant t, at which the clocks that are `due` tick."""
    first = 2 * n_free(system)
    N, V = node_motions(t, y, system)
    for clock, now in zip(clocks_of(system), due):
        actor = system.actors[clock.actor]
        at = slice(first + actor.states[0], first + actor.states[1])
        motions = tuple((N[:, list(nodes)], V[:, list(nodes)]) for nodes in actor.nodes)
        states = y[at].reshape(-1, len(actor.nodes[0]))
        new = jax.vmap(
            lambda e, m, s, k=clock.which: e.ticked(k, t, m, s), in_axes=-1, out_axes=-1
        )(actor.element, motions, states)
        y = y.at[at].set(jnp.where(now, new, states).ravel())
    return y
