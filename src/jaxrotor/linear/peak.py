"""The peak of the response to unbalance: where, how high, and how both depend on every parameter."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.result_text import shows
from ..machine.machine import Machine
from .orders import unbalance_response

_NARROW = 1e-8  # of the speed: as near as levels can tell it


@shows(speed="rad/s")
class Peak(NamedTuple):
    """`speed`: rad/s. `amplitude`: in the unit of the output."""

    speed: Float[Array, ""]
    amplitude: Float[Array, ""]


@takes(start=number("rad/s"), stop=number("rad/s"), points=whole(2))
def unbalance_peak(
    machine: Machine,
    output: str,
    start: float,
    stop: float,
    points: int = 61,
    at: Any = "equilibrium",
) -> Peak:
    """The highest peak of one output of `unbalance_response` between the speeds `start` and `stop`, rad/s.

    A scan of `points` speeds finds it; further ones narrow it down, and a Newton step on the slope does the
    rest. Derivatives by every parameter are exact in both modes: of the amplitude those at the peak (it is
    stationary there), of the speed by the implicit function theorem. Raises `InputError` where the response
    has no peak in between.
    """
    if points < 5:
        raise InputError(f"points: at least 5 are needed to find a peak, but there are {points}")
    if not 0 < start < stop:
        raise InputError(
            f"start and stop must be rising and positive, but are {start:g} and {stop:g} rad/s"
        )

    def level(machine, speed):
        return jnp.log(unbalance_response(machine, output, speed, at=at).magnitude[0, 0])

    still = jax.tree.map(jax.lax.stop_gradient, machine)

    def zoom(bracket, _):
        speeds = jnp.linspace(bracket[0], bracket[1], points)
        best = jnp.argmax(jax.lax.map(lambda speed: level(still, speed), speeds))
        inner = jnp.clip(best, 1, points - 2)
        return (speeds[inner - 1], speeds[inner + 1]), best

    rounds = int(np.ceil(np.log(_NARROW * start / (stop - start)) / np.log(2 / (points - 1))))
    ends = jnp.asarray(float(start)), jnp.asarray(float(stop))
    (low, high), best = jax.lax.scan(zoom, ends, length=rounds)
    first = known(best[0])
    if first is not None and int(first) in (0, points - 1):
        raise InputError(
            f"`{output}` has no peak between {start:g} and {stop:g} rad/s: it is largest at "
            f"{start if int(first) == 0 else stop:g} rad/s, an end of the range: ask for another range"
        )

    return Peak(*stationary(lambda speed: level(machine, speed), 0.5 * (low + high)))


def stationary(
    level: Callable[[Array], Array], near: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Where a logarithmic `level` has its maximum, from as near as a search can tell, and how high it is
    (no logarithm any more). What `level` closes over counts in the derivatives, first ones, both modes."""

    def rising(x):
        return jax.jvp(level, (x,), (jnp.ones_like(x),))

    (height, slope), (_, curvature) = jax.jvp(rising, (near,), (jnp.ones_like(near),))
    curvature = jax.lax.stop_gradient(curvature)
    step = -slope / curvature
    # a parabola through what is known beside the peak: as exact as the Newton step, and no further copy
    d = jax.lax.stop_gradient(step)
    return near + step, jnp.exp(height + slope * d + 0.5 * curvature * d**2)
