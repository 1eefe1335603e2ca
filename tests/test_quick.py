"""Options of the compiler by the program's size: what is traced, and which options it is compiled with."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core import quick


def turned(n, m):
    """A loop of `n` operations beside `m` others."""

    def f(x):
        for _ in range(m):
            x = jnp.cos(x)

        def body(c, _):
            for _ in range(n):
                c = jnp.sin(c)
            return c, None

        return jax.lax.scan(body, x, None, length=3)[0]

    return f


@pytest.mark.parametrize("n, m", [(7, 2), (2, 30)])
def test_the_largest_loop_is_counted(n, m):
    x = jnp.ones(3)
    plain = turned(n, m)
    assert quick.largest_loop(jax.make_jaxpr(plain)(x).jaxpr) == n
    both = lambda x: jax.jit(plain)(x) + jax.jit(turned(n - 1, 0))(x)  # noqa: E731
    assert quick.largest_loop(jax.make_jaxpr(both)(x).jaxpr) == n
    twice = lambda x: jax.lax.fori_loop(0, 2, lambda _, x: jax.jit(plain)(x), x)  # noqa: E731
    # the loop, the program in it and the index
    assert n + m + 2 <= quick.largest_loop(jax.make_jaxpr(twice)(x).jaxpr) <= n + m + 4


def test_each_size_has_its_options_and_is_traced_once(monkeypatch):
    asked, count = [], []
    takes = quick._takes

    def seen(**options):
        asked.append(options)
        return takes(**options)

    monkeypatch.setattr(quick, "_LARGE", 5)
    monkeypatch.setattr(quick, "_takes", seen)
    monkeypatch.setenv("XLA_FLAGS", "")  # the tests' own options, but not those that are asked for

    def f(x, large):
        count.append(large)
        return turned(8 if large else 2, 1)(x)

    run = jr.jit(f)
    x = jnp.linspace(0, 1, 4)
    for k, large in enumerate((False, True, False, True), start=1):
        np.testing.assert_allclose(run(x, large), turned(8 if large else 2, 1)(x), rtol=1e-14)
        assert len(count) == min(k, 2)
    levels = [o["xla_backend_optimization_level"] for o in asked]
    assert levels == [2, 0]
