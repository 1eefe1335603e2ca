"""What a linear shaft does beyond K and C because it turns, the same for a piece of it and for all of it.

Motions of n stations are (6, n); matrices stand node by node, as elements give them.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def turned(q: Float[Array, "6 *n"]) -> Float[Array, "6 *n"]:
    """The rates of a rigid turn about z at unit speed: x' = -y, y' = x, psi' = -theta, theta' = psi."""
    zero = jnp.zeros_like(q[0])
    return jnp.stack([-q[1], q[0], zero, -q[4], q[3], zero])


def gyroscopic_forces(
    G: Float[Array, "m m"], v: Float[Array, "6 n"], spin: Float[Array, " n"]
) -> Float[Array, "6 n"]:
    """`-G v` per unit of spin (about the shaft's own axis, rad/s), workless where spins differ, too."""
    return -0.5 * (spin * _product(G, v) + _product(G, spin * v))


def circulatory_forces(
    B: Float[Array, "m m"],
    q: Float[Array, "6 n"],
    v: Float[Array, "6 n"],
    shared: Float[Array, "n n"] | None = None,
) -> Float[Array, "6 n"]:
    """What rotating damping `-B (v - W×q)` has beyond `-B v`, and its reaction on the spin. W is each
    station's own, or where they stand far apart what of all spins each has, `shared` (symmetric): a bent
    shaft that turned by steps would bend at each."""
    turn, spin = turned(q), v[5] if shared is None else shared @ v[5]
    circulatory = _product(B, spin * turn)
    about = jnp.sum((circulatory - _product(B, v)) * turn, axis=0)
    about = about if shared is None else shared @ about
    return jnp.concatenate([circulatory[:5], circulatory[5:] - about])


def turning_forces(
    G: Float[Array, "m m"],
    rotating: Float[Array, "m m"] | None,
    q: Float[Array, "6 n"],
    v: Float[Array, "6 n"],
    spin: Float[Array, " n"],
    shared: Float[Array, "n n"] | None = None,
) -> Float[Array, "6 n"]:
    """Of both; `rotating`: what of the damping turns with the shaft."""
    found = gyroscopic_forces(G, v, spin)
    return found if rotating is None else found + circulatory_forces(rotating, q, v, shared)


def _product(X: Array, v: Array) -> Array:
    return (X @ v.T.ravel()).reshape(-1, 6).T
