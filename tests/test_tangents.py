"""A loop whose tangents go one after another, against the same loop as JAX derives it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxrotor.integrators.tangents import tangents_in_turn

START = jnp.asarray([0.3, -0.2, 0.5])


def after(p, turned, stays=2.0):
    """Of a loop that closes over parameters, a whole number and constants."""
    whole = jnp.asarray(3)

    def step(y, j):
        y = y + 0.1 * jnp.sin(p * y[::-1] + stays * j) + jnp.where(j < whole, p[0], 0.0)
        return y, y[0] * p[1]

    ready = tangents_in_turn(step) if turned else step
    y, seen = jax.lax.scan(ready, START * p[2], jnp.arange(6))
    return jnp.concatenate([y, seen])


P = jnp.asarray([0.7, 1.3, -0.4])
MANY = P + jnp.linspace(0, 1, 4)[:, None]


@pytest.mark.parametrize(
    "derived",
    [
        lambda f: jax.jacfwd(f)(P),
        lambda f: jax.jvp(f, (P,), (jnp.ones(3),)),
        lambda f: jax.vmap(jax.jacfwd(f))(MANY),
        lambda f: jax.jacfwd(jax.vmap(f))(MANY),
        lambda f: jax.jacfwd(lambda stays: f(P, stays=stays))(2.0),
    ],
    ids=["jacobian", "one tangent", "members' Jacobians", "Jacobian of members", "constant"],
)
def test_as_jax_derives_it(derived):
    ours = jax.jit(lambda: derived(lambda p=P, **k: after(p, True, **k)))()
    theirs = jax.jit(lambda: derived(lambda p=P, **k: after(p, False, **k)))()
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs)):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)
