"""Between the unknowns of the balance and a motion as its user sees it."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..linear.eigen import eigensystem
from ..machine.field import n_free, unpack
from ..machine.system import System
from ..simulation.state import from_flat
from .balance import states_of
from .floquet import monodromy
from .motion import PeriodicMotion
from .waves import Waves


def described(
    system: System, x: Float[Array, " s1"], waves: Waves, stations: tuple[str, ...]
) -> PeriodicMotion:
    """`x`: the coefficients, row after row, and the speed behind them."""
    coefficients, speed = x[:-1].reshape(waves.count, -1), x[-1]
    n, zero = n_free(system), jnp.zeros(())
    angles = jnp.asarray(waves.angles)
    y = states_of(coefficients, speed, n, waves.at(waves.angles), waves)
    turns = system.turns()

    def seen(angle, y) -> tuple[Array, Array]:
        reference = (angle, speed, zero)
        state = from_flat(zero, y, system, reference)
        position = state.position.at[:, 5].add(-turns * angle)
        return position, unpack(zero, y, system, reference)[2]

    position, internal = jax.vmap(seen)(angles, y)
    values, _, _ = eigensystem(monodromy(system, coefficients, speed, waves))
    order = jnp.argsort(-jnp.abs(jax.lax.stop_gradient(values)))
    return PeriodicMotion(
        speed,
        _complex(position, waves),
        _complex(internal, waves),
        values[order],
        from_flat(zero, y[0], system, (zero, speed, zero)),
        tuple(waves.orders.tolist()),
        waves.turns,
        stations,
    )


def _complex(samples: Float[Array, "N ..."], waves: Waves) -> Complex[Array, "w ..."]:
    """Orders of what was sampled: Re(coefficient e^(i order angle))."""
    found = jnp.tensordot(jnp.asarray(waves.from_samples), samples, 1)
    waved = jax.lax.complex(found[1::2], -found[2::2])
    return jnp.concatenate([jax.lax.complex(found[:1], jnp.zeros_like(found[:1])), waved])


def unknowns(system: System, motion: PeriodicMotion, waves: Waves) -> Float[Array, "w m"]:
    """The coefficients of a motion, of whatever orders, among these waves."""
    layout = system.layout
    component, station = np.divmod(np.array(layout.free, int), layout.n_mass)
    place = np.argsort(np.array(layout.internal))[station]  # the user's number of each station
    along = motion.coefficients[:, place, component]
    if motion.internal.shape[1]:
        along = jnp.concatenate([along, motion.internal], axis=1)
    rows = [jnp.zeros(along.shape[1])] * waves.count
    for order, row in zip(motion.orders, along):
        k = round(order * waves.turns)
        if k > waves.harmonics * waves.turns or abs(k - order * waves.turns) > 1e-9:
            continue
        if k == 0:
            rows[0] = row.real
        else:
            rows[2 * k - 1], rows[2 * k] = row.real, -row.imag
    return jnp.stack(rows)
