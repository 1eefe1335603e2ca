"""Machines on a ground that moves: when it shakes most, and how far it carries them.

Stations are told in space that stands still, where a record of the ground goes far and what bends a shaft is
a small difference. So pilots set out from a ground that has just begun to move, and errors count as part of
the motion against it.
"""

import dataclasses
import warnings
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.parameter import numbers
from ..core.quick import quickly_compiled
from ..machine.system import Actor, System
from ..profiles.base import LARGEST_TURN, AbstractBase, Released
from .response import Response


def _is_base(x: Any) -> bool:
    return isinstance(x, AbstractBase)


def bases(system: System) -> list[AbstractBase]:
    """Every ground of the machine; each of its leaves has a last axis, of parts that are alike."""
    return _among([a.element for a in system.actors])


def _among(tree: Any) -> list[AbstractBase]:
    return [x for x in jax.tree.leaves(tree, is_leaf=_is_base) if _is_base(x)]


def released(system: System, when: Array, since: Array) -> System:
    """Whose ground was still until `when` (s), `since` then."""
    if not bases(system):
        return system

    def let_go(actor: Actor) -> Actor:
        count = len(actor.nodes[0])
        times = [jnp.broadcast_to(x, (count,)) for x in (when, since)]
        element = jax.tree.map(
            lambda x: Released(x, *times) if _is_base(x) else x, actor.element, is_leaf=_is_base
        )
        return dataclasses.replace(actor, element=element)

    return eqx.tree_at(lambda s: s.actors, system, tuple(let_go(a) for a in system.actors))


def carried(system: System, times: Float[Array, " nt"]) -> Float[Array, "nt 6"] | None:
    """Coordinates of the ground, of the first where there are several; `None` of one that stands still."""
    return jax.vmap(lambda t: _place(system, t))(times) if bases(system) else None


def carried_since(
    system: System, when: Array, times: Float[Array, " nt"]
) -> Float[Array, "nt 6"] | None:
    """As `carried`, of a ground that was `released`, so many seconds after `when`."""
    if not bases(system):
        return None
    return jax.vmap(lambda t: _place(released(system, when, t), when))(times)


def _place(system: System, t: Array) -> Float[Array, "6"]:
    """Of the first ground."""
    return jax.vmap(lambda base: base.at(t)[0], in_axes=-1)(bases(system)[0])[0]


def shaking(system: System, times: Float[Array, " nt"]) -> Float[Array, " nt"]:
    """How strongly all grounds accelerate: the largest of the six (m/s², rad/s²)."""
    strongest = jnp.zeros(times.shape)
    for one in bases(system):

        def now(t: Array, one: AbstractBase = one) -> Array:
            return jnp.max(jnp.abs(jax.vmap(lambda base: base.at(t)[2], in_axes=-1)(one)))

        strongest = jnp.maximum(strongest, jax.vmap(now)(times))
    return strongest


def tell_turns(response: Response) -> None:
    """Warns of a ground that turned by more than first order bears."""
    if not _among(response.machine):
        return  # before anything is assembled
    most = float(numbers(_most_turned(response._system, response.t)))
    if most > LARGEST_TURN:
        warnings.warn(
            f"the ground turned by {most:.3g} rad, but {LARGEST_TURN} rad are what first order is right of: "
            "the weight's part along a floor that leans is left out, and forces that lean with it",
            stacklevel=3,
        )


@quickly_compiled
def _most_turned(system: System, times: Float[Array, " nt"]) -> Float[Array, ""]:
    turned = [
        jax.vmap(lambda t, one=one: jax.vmap(lambda b: b.at(t)[0][3:], in_axes=-1)(one))(times)
        for one in bases(system)
    ]
    return jnp.max(jnp.abs(jnp.concatenate([x.ravel() for x in turned])))
