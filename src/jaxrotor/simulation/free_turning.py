"""Which turnings about the axis nothing resists: the common one of each free line."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.picked import block
from ..core.protocol import Nominal
from ..machine.field import initial_states
from ..machine.speed_ratios import port_turns
from ..machine.system import Actor, System

# What resists a turning by less than this part of what the stiffest shaft would resists nothing.
_HELD = 1e-9
# How far a law without slope at rest is turned to see whether it holds: a play does, a clutch does not. rad
_TURNED = (1e-2, 1.0, 10.0)


class Turning(NamedTuple):
    """Of the free coordinates, (f, f) each.

    `free`: the projector onto the turnings that nothing resists. `farther`: N·m/rad by which laws without
    slope at rest resist once they are turned, as across a play.
    """

    free: Array
    farther: Array


def turning_at_rest(system: System) -> Turning | None:
    """`None` where no station can turn.

    A line is what shafts, couplings and gears hold together, over a play, too; a clutch parts it, for its
    torque does not depend on how far it has slipped. A line is free where neither a drive nor a spring to the
    ground holds it. (At rest its parts may be out of balance together, never against each other.)
    """
    layout = system.layout
    free = np.array(layout.free, int)
    turning = free // max(1, layout.n_mass) == 5
    if not turning.any():
        return None
    n = layout.n_nodes + layout.n_ground
    slopes = [-system.whole.reshape(6, n, 2, 6, n)[5, :, 0, 5], jnp.zeros((n, n))]
    for actor in system.actors:
        slopes = [x + more for x, more in zip(slopes, _resistance(actor, system, n))]
    # ports turn with their stations, those behind gears so many times
    owner: Any = np.zeros((n, layout.n_mass))
    owner[np.arange(layout.n_nodes), np.array(layout.node_station, int)] = 1.0
    for node, turns in port_turns(layout, system.stations).items():
        own = np.zeros_like(owner)
        own[node] = owner[node]
        owner = jax.lax.stop_gradient(owner + own * (turns - 1))
    at = free[turning] % layout.n_mass
    near, far = (block(jax.lax.stop_gradient(owner.T @ x @ owner), at, at) for x in slopes)
    S = 0.5 * (near + near.T + far + far.T)
    size = jnp.sqrt(jnp.abs(jnp.diagonal(S)))
    size = jnp.where(size > 0, size, 1.0)
    values, vectors = jnp.linalg.eigh(S / size / size[:, None])
    loose = jnp.where(jnp.abs(values) <= _HELD * jnp.max(jnp.abs(values)), vectors, 0.0)
    loose = loose / size[:, None]
    into = np.zeros((free.size, at.size))
    into[turning.nonzero()[0], np.arange(at.size)] = 1.0
    place = jnp.asarray(into)
    return Turning(place @ (loose @ jnp.linalg.pinv(loose)) @ place.T, place @ far @ place.T)


def _resistance(actor: Actor, system: System, n: int) -> tuple[Array, Array]:
    """N·m/rad of a law at each node for turning each node, all else at rest, (n, n): its slope, and for
    members without any the least of the secants over `_TURNED` that shows one."""
    ends, count = len(actor.nodes), len(actor.nodes[0])
    state = initial_states(system)[slice(*actor.states)].reshape(-1, count)
    states = state if state.size else None
    still = jnp.zeros((ends, count))
    element = actor.element
    if isinstance(element, Nominal):
        # what goes with the shaft's angle, as teeth's errors do, holds nothing
        element = jax.vmap(lambda e: e.nominal(), in_axes=-1, out_axes=-1)(element)

    def torques(angles):  # (ends, members)
        at = jnp.zeros((6, count))
        motions = tuple((at.at[5].set(angles[k]), at) for k in range(ends))
        found = jax.vmap(lambda e, m, s: e.forces(jnp.zeros(()), m, s), in_axes=-1, out_axes=-1)(
            element, motions, states
        )
        if found is None:  # what is left of a crack or a bow without the shaft's angle
            return jnp.zeros((ends, count))
        return jnp.stack([force[5] for force in found])

    # (ends that answer, ends that are turned, members)
    each_end = jnp.eye(ends)[:, :, None] * jnp.ones(count)
    slope = -jax.vmap(lambda d: jax.jvp(torques, (still,), (d,))[1], out_axes=1)(each_end)
    slope = jnp.nan_to_num(slope)
    # one program of the law for all looks at it
    turned = np.multiply.outer((0.0, *_TURNED), np.eye(ends))[..., None] * np.ones(count)
    found = jax.vmap(jax.vmap(torques, out_axes=1))(turned)
    farther = jnp.zeros_like(slope)
    for turn, at in zip(_TURNED, found[1:]):
        shown = jnp.any(slope + farther != 0, axis=(0, 1))
        farther = jnp.where(shown, farther, (found[0] - at) / turn)
    nodes = np.array(actor.nodes, int)
    at = nodes[:, None], nodes[None]
    return jnp.zeros((n, n)).at[at].add(slope), jnp.zeros((n, n)).at[at].add(farther)
