"""The viscosity at which a bearing's oil carries away the heat of its own shear.

One effective temperature: what shear takes (power) leaves with the oil that passes the ends (leakage), or a
part of it does. Above the supply by dT the viscosity is `viscosity exp(-thinning dT)`. With s its logarithm
over that of the supply, s + thinning dT(s) = 0: rising and convex, so secants from s = 0 come down to the
root and never pass it. Source: Lund & Thomsen (1978); Khonsari & Booser, Applied Tribology (2001), ch. 8.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array

from .pads import Pads

_MET, _STEPS = 1e-11, 40


def warmed(
    at: Callable[[Pads], tuple[Array, Array]], pads: Pads, thinning: Array, capacity: Array
) -> Pads:
    """`pads` with the viscosity of the balance; `at` gives power (W) and leakage (m³/s) at one, `capacity` is
    that of the oil per volume over the part of the heat that it takes, J/(m³ K). Differentiable."""

    def missing(s, pads=pads, thinning=thinning, capacity=capacity):
        power, leakage = at(pads._replace(viscosity=pads.viscosity * jnp.exp(s)))
        return s + thinning * power / (capacity * leakage)

    still = jax.lax.stop_gradient((pads, thinning, capacity))

    def step(carried):
        s, before, of_before, _, k = carried
        found = jax.lax.stop_gradient(missing(s, *still))
        apart = jnp.where(k > 0, s - before, 1.0)
        slope = jnp.where(k > 0, (found - of_before) / apart, 1 + found)
        met = jnp.abs(found) <= _MET
        after = jnp.where(met, s, s - found / jnp.maximum(slope, 1.0))
        return after, s, found, met | jnp.isnan(found), k + 1

    zero = jnp.zeros(())
    s = jax.lax.while_loop(
        lambda c: ~c[3] & (c[4] < _STEPS), step, (zero, zero, zero, jnp.zeros((), bool), 0)
    )[0]
    s = jax.lax.custom_root(missing, s, lambda _, s: s, lambda linear, y: y / linear(1.0))
    return pads._replace(viscosity=pads.viscosity * jnp.exp(s))
