"""The balanced machine at one state and speed, as numbers: its rates, its loads and their slopes, all from
one small program that is quickly compiled."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.columns import columns
from ..core.errors import InputError
from ..core.quick import quickly_compiled
from ..machine.field import initial_states, n_free, on_nodes, rates_and_loads
from ..machine.machine import Machine
from ..machine.system import System
from ..machine.wiring import unknown
from ..simulation.assembling import system_of, systems_of
from ..simulation.free_turning import Turning, turning_at_rest
from ..simulation.state import State, from_flat, to_flat


class Prepared(NamedTuple):
    """The machine without what turns with the shaft, assembled; which turnings nothing resists; the flat
    state from which an equilibrium is looked for; and the angle of the reference spin at t = 0."""

    system: System
    turning: Turning | None
    start: Float[Array, " d"]
    angle: Float[Array, ""]


class Instant(NamedTuple):
    """At a flat state y = (u, u', z) with n free coordinates and k internal states, d = 2 n + k.

    - `rates`: (d,), dy/dt; `loads`: (n + k,), of which a steady state has none: those on the free
      coordinates, and z'.
    - `A`: (d, d), `B`: (d, n): how y, and generalized forces on the free coordinates, change the rates.
      `pull`: (n + k, d), how y changes the loads. - `state`: y as a person sees it.
    """

    rates: np.ndarray
    loads: np.ndarray
    A: np.ndarray
    B: np.ndarray
    pull: np.ndarray
    state: State


def prepare(machine: Machine) -> Prepared:
    return _prepared(system_of(machine, nominal=True))


def prepare_both(machine: Machine) -> tuple[Prepared, System]:
    """And the machine as it is, assembled."""
    actual, nominal = systems_of(machine)
    return _prepared(nominal), actual


def ratio_of(machine: Machine, shaft: str) -> float:
    """How many times as fast as the driven shaft that of a station turns."""
    stations = machine.wiring.stations
    if shaft not in stations:
        raise InputError(f"shaft: {unknown('station', shaft, stations)}")
    turns = np.asarray(prepare(machine).system.turns())
    return abs(float(turns[stations.index(shaft)]))


@quickly_compiled
def _prepared(system: System) -> Prepared:
    start = jnp.concatenate([jnp.zeros(2 * n_free(system)), initial_states(system)])
    turning = jax.tree.map(jnp.asarray, turning_at_rest(system))
    return Prepared(system, turning, start, system.reference(jnp.zeros(()))[0])


def instant(prepared: Prepared, y: Any, speed: float, force: np.ndarray | None = None) -> Instant:
    """`force`: (n,), from outside, on the free coordinates."""
    n, d = n_free(prepared.system), len(y)
    force = np.zeros(n) if force is None else force
    # in one array: thousands of speeds are gone through, and each array on its way takes as long as the rest
    given = jax.device_put(np.concatenate([y, force, [speed]]))
    found, slopes, state = _instant(prepared.system, prepared.angle, given)
    found, slopes = np.asarray(found), np.asarray(slopes)
    return Instant(
        found[:d],
        found[d:],
        slopes[:d, :d],
        slopes[:d, d:],
        slopes[d:, :d],
        jax.tree.map(np.asarray, state),
    )


@quickly_compiled
def _instant(system: System, angle, given) -> tuple[Array, Array, State]:
    """`given`: y, forces, and the speed."""
    reference, d = (angle, given[-1], jnp.zeros(())), given.size - 1 - n_free(system)
    slopes, values = columns(
        lambda both: field_and_loads(system, both[:d], reference, both[d:]), given[:-1]
    )
    return values, slopes, from_flat(jnp.zeros(()), given[:d], system, reference)


def field_and_loads(system: System, y: Array, reference: Any, force: Array) -> Float[Array, " m"]:
    """`rates` and `loads` as one vector."""
    applied = on_nodes(system, force)
    return jnp.concatenate(rates_and_loads(jnp.zeros(()), y, system, reference, applied))


def flat_state(prepared: Prepared, state: State, speed: float) -> np.ndarray:
    return np.asarray(_flat_state(prepared, state, jax.device_put(np.float64(speed))))


@quickly_compiled
def _flat_state(prepared: Prepared, state: State, speed) -> Float[Array, " d"]:
    return to_flat(state, prepared.system, (prepared.angle, speed, jnp.zeros(())))
