"""The stiff solver's pieces: elimination, order and stability of the method, its loop and what reverse mode
goes through again."""

from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxrotor.core.elimination import inverse
from jaxrotor.core.picked import picked
from jaxrotor.integrators.adaptive import adaptive_samples
from jaxrotor.integrators.replay import replayed_while_loop
from jaxrotor.integrators.rosenbrock import Rosenbrock


def _matrices(n, rng):
    plain = rng.normal(size=(n, n))
    yield plain
    yield plain * 10.0 ** rng.uniform(-8, 8, (n, 1))  # rows in any units
    yield plain - np.diag(np.diag(plain))  # no pivot where it is looked for first
    yield np.eye(n) / 1e-5 + plain * 10.0 ** rng.uniform(0, 10, (n, 1))  # as a stiff step has them


@pytest.mark.parametrize("n", [2, 5, 12, 40])
def test_inverse(n):
    """Against NumPy's of the same matrix, its rows brought to one size: to what its condition allows."""
    found = jax.jit(inverse)
    for matrix in _matrices(n, np.random.default_rng(n)):
        size = np.max(np.abs(matrix), axis=1)
        scaled = matrix / size[:, None]
        exact = np.linalg.inv(scaled)
        off = np.max(np.abs(np.asarray(found(matrix)) * size - exact)) / np.max(np.abs(exact))
        assert off < 1e-15 * np.linalg.cond(scaled)
    assert not np.all(np.isfinite(found(np.ones((n, n)))))


def test_elimination_is_one_kernel_material():
    """What keeps a loop from being one kernel: library calls, scatters, sorts."""
    text = jax.jit(inverse).lower(jnp.eye(5)).as_text()
    assert not [word for word in ("custom_call", "scatter", "sort") if f"stablehlo.{word}" in text]


def test_picked():
    x = jnp.arange(24.0).reshape(2, 12)
    for index in ((), (3,), (4, 5, 6), (7, 0, 1, 1, 11), tuple(range(11, -1, -1))):
        np.testing.assert_array_equal(picked(x, index), np.asarray(x)[:, list(index)])
    slope = jax.jit(jax.grad(lambda x: jnp.sum(picked(x, (7, 0, 1)) ** 2)))
    assert "scatter" not in slope.lower(x).as_text()


@pytest.mark.parametrize("passes", [0, 1, 4, 5, 11])
def test_replayed_loop(passes):
    """Slopes by start and by what the body holds, against the same passes written out; four are kept at a
    time. Members of a batch end after different numbers of passes."""

    def step(y, z, a):
        return jnp.sin(a * y) + z * y, 0.9 * z

    def looped(x, a, n):
        def body(carry):
            return carry[0] + 1, *step(*carry[1:], a)

        end = replayed_while_loop(lambda c: c[0] < n, body, (jnp.zeros((), int), x, a), kept=4)
        return jnp.sum(end[1] ** 2) + end[2]

    def unrolled(x, a, n):
        y, z = x, a
        for _ in range(n):
            y, z = step(y, z, a)
        return jnp.sum(y**2) + z

    x, a = jnp.array([0.3, -0.2]), jnp.asarray(0.7)
    counts = (passes, 2)
    batch = jax.jit(jax.vmap(jax.grad(looped, (0, 1)), (None, None, 0)))(x, a, jnp.array(counts))
    for i, n in enumerate(counts):
        for one, exact in zip(batch, jax.grad(unrolled, (0, 1))(x, a, n)):
            np.testing.assert_allclose(one[i], exact, rtol=1e-12, atol=1e-14)


class Layout(eqx.Module):
    free: tuple[int, ...] = eqx.field(static=True, default=(0,))


class Args(eqx.Module):
    """What the solver asks of a machine."""

    stiffness: Any
    layout: Layout = Layout()


# Prothero & Robinson's equation, as a machine of one coordinate has it:
# u'' = -k (u - sin t) - c (u' - cos t) - sin t has the solution sin t, however stiff k and c are.
STIFF = (1e6, 1e4)


def _field(t, y, args):
    k, c = args.stiffness
    return jnp.stack([y[1], -k * (y[0] - jnp.sin(t)) - c * (y[1] - jnp.cos(t)) - jnp.sin(t)])


def _run(samples, y0=(0.0, 1.0), stiffness=STIFF, field=_field, jumps=(), **settings):
    settings = dict(rtol=1e-7, atol=1e-10) | settings
    return adaptive_samples(
        Rosenbrock(),
        diffrax.ODETerm(field),
        jnp.asarray(samples),
        jnp.asarray(jumps, float),
        jnp.asarray(y0, float),
        Args(stiffness),
        **settings,
    )


def test_a_stiff_machine_in_steps_of_its_motion():
    """Steps two hundred times as long as the fast motion's decay; samples between them."""
    samples = np.linspace(0.0, 10.0, 333)
    y, steps = jax.jit(lambda: _run(samples))()
    np.testing.assert_allclose(y[:, 0], np.sin(samples), atol=1e-8)
    assert steps < 500


def test_fifth_order_beyond_stiffness():
    """u'' = -u (1 + u^2) + cos t, u(0) = 1: each halving of the step gains 2^5 and more."""

    def field(t, y, args):
        return jnp.stack([y[1], -y[0] * (1 + y[0] ** 2) + jnp.cos(t)])

    run = jax.jit(lambda h: _run([0.0, 2.0], (1.0, 0.0), field=field, step=h)[0][-1])
    exact = diffrax.diffeqsolve(
        diffrax.ODETerm(field), diffrax.Dopri8(), 0.0, 2.0, 0.01, jnp.array([1.0, 0.0]),
        stepsize_controller=diffrax.PIDController(1e-13, 1e-13), max_steps=10_000,
    ).ys[-1]  # fmt: skip
    errors = [float(jnp.max(jnp.abs(run(h) - exact))) for h in (0.2, 0.1, 0.05)]
    assert errors[0] / errors[1] > 2**4.5 and errors[1] / errors[2] > 2**4.5 and errors[2] < 1e-7


def test_the_loop_of_diffrax_goes_the_same_steps():
    """The same method and controller through `diffrax.diffeqsolve`, as an adjoint of its own kind has it: the
    same samples and number of steps, also past a jump; and the same slopes in both modes."""
    samples = np.linspace(0.0, 2.0, 201)  # as far apart as diffrax's first step is long

    def field(t, y, args):
        k, c = args.stiffness
        return jnp.stack([y[1], -k * y[0] ** 3 - c * y[1] + jnp.where(t < 0.777, 1.0, -2.0)])

    def run(stiffness, adjoint):
        return _run(samples, (1.0, 0.0), stiffness, field, (0.777,), adjoint=adjoint)

    def slopes(adjoint, way):
        return way(lambda s: (run(s, adjoint)[0][-1, 0],) * 2, has_aux=True)

    at = jnp.array([30.0, 0.3])
    ours, steps = jax.jit(lambda s: run(s, None))(at)
    theirs, others = jax.jit(lambda s: run(s, diffrax.DirectAdjoint()))(at)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)
    assert steps == others > 50
    reverse, end = jax.jit(slopes(None, jax.grad))(at)
    forward, same = jax.jit(slopes(diffrax.ForwardMode(), jax.jacfwd))(at)
    np.testing.assert_allclose([end, same], ours[-1, 0], rtol=1e-9)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9)
    h = 1e-4 * at
    alone = jax.jit(lambda s: run(s, None)[0][-1, 0])
    central = [
        (alone(at.at[i].add(h[i])) - alone(at.at[i].add(-h[i]))) / (2 * h[i]) for i in (0, 1)
    ]
    np.testing.assert_allclose(reverse, central, rtol=1e-4)
