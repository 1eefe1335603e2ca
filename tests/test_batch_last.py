"""The batch along the last axis: every operation is what `jax.vmap` makes of it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

import jaxrotor as jr
from jaxrotor.core.batch_last import Value, batch_last
from jaxrotor.integrators.abreast import scanned_abreast
from jaxrotor.machine.field import n_free, vector_field
from jaxrotor.machine.system import assemble

SIZE = 5


def assert_agree(function, *given, same=()):
    """`given`: of one member; those at `same` are the same for all."""
    rng = np.random.default_rng(0)
    traced = jax.make_jaxpr(function)(*given)
    own, last, axes = [], [], []
    for i, x in enumerate(given):
        x = jnp.asarray(x)
        if i in same:
            own.append(x), last.append(Value(x, False)), axes.append(None)
        elif jnp.issubdtype(x.dtype, jnp.integer):
            rows = jnp.asarray(rng.integers(0, 2, (SIZE, *x.shape)))
            own.append(rows), last.append(Value(jnp.moveaxis(rows, 0, -1), True)), axes.append(0)
        else:
            rows = jnp.asarray(rng.uniform(0.1, 0.9, (SIZE, *x.shape)))
            own.append(rows), last.append(Value(jnp.moveaxis(rows, 0, -1), True)), axes.append(0)
    want = jax.tree.leaves(jax.vmap(function, tuple(axes))(*own))
    found = batch_last(traced, last, SIZE)
    assert len(found) == len(want)
    for value, w in zip(found, want, strict=True):
        x = jnp.moveaxis(value.array, -1, 0) if value.batched else jnp.stack([value.array] * SIZE)
        np.testing.assert_allclose(x, w, rtol=1e-13, atol=1e-14)


A, B, C = jnp.ones((3, 4)), jnp.ones((4, 3)), jnp.ones((2, 3, 4))
N = jnp.asarray(1)


@pytest.mark.parametrize(
    "function, given, same",
    [
        (lambda a, b: a @ b, (A, B), (0,)),
        (lambda a, b: a @ b, (A, B), (1,)),
        (lambda a, b: a @ b, (A, B), ()),
        (lambda a, x: jnp.einsum("kij,kj->ki", a, x), (C, jnp.ones((2, 4))), (0,)),
        (lambda a, x: jnp.einsum("kij,kjl->kil", a, x), (C, jnp.ones((2, 4, 2))), (1,)),
        (lambda a, x: jnp.einsum("kij,kj->ki", a, x), (C, jnp.ones((2, 4))), ()),
        (lambda a: a.reshape(6, 4).T, (C,), ()),
        (lambda a: a[:, 1:3, ::2] + a[0, 0, 1], (C,), ()),
        (lambda a: a[:, jnp.array([2, 0])], (A,), ()),
        (lambda a, n: a[n], (A, N), ()),
        (lambda a, n: a[n], (A, N), (1,)),
        (lambda a, n: a[n], (A, N), (0,)),
        (lambda a, n: a.at[n].set(2.0), (A, N), (1,)),
        (lambda a, n: a.at[n].set(2.0), (A, N), ()),
        (lambda a, n: lax.dynamic_update_slice(a, a[:1] * 2, (n, 0)), (A, N), (1,)),
        (lambda a, n: lax.dynamic_update_slice(a, a[:1] * 2, (n, 0)), (A, N), ()),
        (lambda a, b: jnp.concatenate([a, b.T], axis=1), (A, B), (1,)),
        (lambda a, b: jnp.stack([a, b.T, a], axis=1), (A, B), (0,)),
        (lambda a: jnp.where(a > 0.5, a, 2.0), (A,), ()),
        (lambda a, x: jnp.where(x > 0.5, a, -a), (A, 1.0), ()),
        (lambda a, x: jnp.where(x > 0.5, a, -a), (A, 1.0), (1,)),
        (lambda a, x: jnp.where(x > 0.5, a, -a), (A, 1.0), (0,)),
        (lambda a: jnp.pad(a, ((1, 0), (0, 2))), (A,), ()),
        (lambda a, x: jnp.pad(a, 1, constant_values=x), (A, 1.0), ()),
        (lambda a: (a.sum(0), a.max(1), a.min(), jnp.argmax(a), jnp.cumsum(a, 1)), (A,), ()),
        (lambda a: jnp.split(a, [1, 3], axis=1), (A,), ()),
        (lambda a: jnp.flip(a, 1) ** 3 + jnp.hypot(a, 1.0) + jnp.arctan2(a, 2.0), (A,), ()),
        (lambda a: jnp.clip(a, 0.3, 0.6) + jnp.sign(a) * jnp.exp(-a) + 1 / jnp.sqrt(a), (A,), ()),
        (lambda a, x: lax.cond(x > 0.5, jnp.sin, jnp.cos, a), (A, 1.0), ()),
        (lambda a, x: lax.cond(x > 0.5, jnp.sin, jnp.cos, a), (A, 1.0), (1,)),
        (lambda a: lax.fori_loop(0, 3, lambda i, x: x * 0.5 + i, a), (A,), ()),
        (lambda a: jnp.linalg.solve(a @ a.T + jnp.eye(3), a), (A,), ()),
        (lambda a: (jnp.arange(3.0), a.astype(int), ~(a > 0.5), jnp.sinc(a)), (A,), ()),
        (jax.jit(lambda a, x: x + 2.0 * a), (A, 1.0), (0,)),
    ],
)
def test_operations(function, given, same):
    assert_agree(function, *given, same=same)


@pytest.mark.parametrize(
    "name", ["two_rotor_startup", "geared_train", "rolling_mill", "cracked_shaft", "overhung_fan"]
)
def test_equations_of_machines(name, request):
    system = assemble(jr.load(request.config.rootpath / f"configs/{name}.toml").machine)
    size = 2 * n_free(system) + system.n_states()
    assert_agree(lambda t, y: vector_field(t, 1e-3 * y, system), 0.0, jnp.ones(size))


def test_a_loop_of_members_with_numbers_of_their_own():
    rng = np.random.default_rng(1)
    W, y = jnp.asarray(rng.normal(size=(4, 4)) / 4), jnp.asarray(rng.normal(size=(SIZE, 4)))
    many = jnp.asarray(rng.normal(size=(SIZE, 30, 30)) / 30)  # beyond what goes side by side
    x = jnp.asarray(rng.normal(size=(SIZE, 30)))

    def run(W, y, c):
        def step(y, j):
            y = jnp.tanh(W @ y) + c * j
            return y, (y[0], j)

        return step, y

    def abreast(W, y, c):
        return scanned_abreast(*run(W, y, c), 7)

    def plain(W, y, c):
        return lax.scan(*run(W, y, c), jnp.arange(7))

    c = jnp.linspace(0.0, 1.0, SIZE)
    for axes, given in (
        ((None, 0, 0), (W, y, c)),
        ((None, None, 0), (W, y[0], c)),
        ((0, 0, 0), (many, x, c)),
    ):
        both = zip(
            jax.tree.leaves(jax.vmap(abreast, axes)(*given)),
            jax.tree.leaves(jax.vmap(plain, axes)(*given)),
            strict=True,
        )
        for a, b in both:
            np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-14)
