"""The peak of the response to unbalance: where, how high, and how both depend on every parameter."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import InputError
from ..machine.machine import Machine
from ..parameter import known
from .orders import unbalance_response

_STEPS = 40
_GOLDEN = 0.5 * (np.sqrt(5) - 1)


class Peak(NamedTuple):
    """`speed`: rad/s. `amplitude`: in the unit of the output."""

    speed: Float[Array, ""]
    amplitude: Float[Array, ""]


def unbalance_peak(
    machine: Machine,
    output: str,
    start: float,
    stop: float,
    points: int = 61,
    at: Any = "equilibrium",
) -> Peak:
    """The highest peak of one output of `unbalance_response` between the speeds `start` and `stop`, rad/s.

    A scan of `points` speeds finds it, golden sections and a Newton step the place. Derivatives by every
    parameter are exact in both modes: of the amplitude those at the peak (it is stationary there), of the
    speed by the implicit function theorem. Raises `InputError` where the response has no peak in between.
    """
    if not 0 < start < stop:
        raise InputError(
            f"start and stop must be rising and positive, but are {start:g} and {stop:g} rad/s"
        )

    def level(machine, speeds):
        return jnp.log(unbalance_response(machine, output, speeds, at=at).magnitude[:, 0])

    def at_speed(speed):
        return level(machine, speed[None])[0]

    still = jax.tree.map(jax.lax.stop_gradient, machine)
    speeds = jnp.linspace(start, stop, points)
    scan = level(still, speeds)
    best = jnp.argmax(scan)
    where = known(best)
    if where is not None and int(where) in (0, points - 1):
        raise InputError(
            f"`{output}` has no peak between {start:g} and {stop:g} rad/s: it is largest at "
            f"{float(speeds[int(where)]):g} rad/s, an end of the range: ask for another range"
        )
    low, high = speeds[best - 1], speeds[best + 1]

    def narrow(_, bracket):
        low, high = bracket
        inner = jnp.stack([high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)])
        left, right = level(still, inner)
        rising = right > left
        return jnp.where(rising, inner[0], low), jnp.where(rising, high, inner[1])

    low, high = jax.lax.fori_loop(0, _STEPS, narrow, (low, high))
    middle = jax.lax.stop_gradient(0.5 * (low + high))

    def slope(speed):
        return jax.jvp(at_speed, (speed,), (jnp.ones_like(speed),))[1]

    value, curvature = jax.jvp(slope, (middle,), (jnp.ones_like(middle),))
    speed = middle - value / jax.lax.stop_gradient(curvature)
    return Peak(speed, jnp.exp(at_speed(jax.lax.stop_gradient(speed))))
