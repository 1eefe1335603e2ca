"""Exact gradients of a run by every physical parameter of the paper's machine, at a fixed step."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

import jaxrotor as jr

# one step a sample: several would be written out one behind the other, and compiled so
STEP = 1e-3
# Run hundreds of times: here the quickest compiling (conftest.py) costs more than it saves.
OFTEN = {"xla_backend_optimization_level": 2, "xla_llvm_disable_expensive_passes": True}


def scalar(machine, adjoint=None):
    """One number that every parameter moves: motions, spin, forces, over 60 ms from 200 rad/s on."""
    run = jr.simulate(machine, 0.06, 1000.0, initial="static", step=STEP, adjoint=adjoint)
    main, second = run["main"], run["second"]
    return (
        1e6 * jnp.sum(main.x**2 + main.y**2)
        + 1e3 * jnp.sum(second.psi**2)
        + 10 * jnp.sum((second.speed - run["end"].speed) ** 2)
        + 1e-6 * jnp.sum(run["left"].bearing_force ** 2)
        + 1e-2 * jnp.sum(run["end"].reaction[:, 5] ** 2)
        + 1e12 * jnp.sum(main.z**2)
    )


@pytest.fixture(scope="module")
def case(two_rotor):
    """(values by path, the scalar of a flat vector of them), as a function compiled once."""
    profile = jr.LinearRamp(speed=260.0, duration=0.0604, start=200.0)  # ends between two samples
    parts = dict(two_rotor("invariant").elements(), end=jr.PrescribedSpin(profile, angle=0.3))
    machine = jr.Machine.in_line(parts, gravity=(0.5, -9.81, 0.2))
    machine = machine.set(
        {
            "end.profile.duration": 0.0334,
            "second.unbalance.inclination": 0.01,
            "second.unbalance.inclination_angle": 0.7,
            "main.unbalance.angle": -0.4,
            "shaft 2.inner_diameter": 0.004,
        }
    )
    values = machine.parameters()
    flat, unravel = ravel_pytree(values)
    function = jax.jit(
        lambda x, adjoint=None: scalar(machine.set(unravel(x)), adjoint), static_argnums=1
    )
    names = [k for k in sorted(values) for _ in range(values[k].size)]
    return names, flat, function


@pytest.fixture(scope="module")
def value(case):
    """The function, compiled to be run often."""
    return jax.jit(case[2], compiler_options=OFTEN)


@pytest.fixture(scope="module")
def reverse(case):
    _, flat, function = case
    return np.asarray(jax.jit(jax.grad(function))(flat))


def test_forward_is_reverse(case, reverse):
    names, flat, function = case
    ready = lambda x: function(x, diffrax.ForwardMode())  # noqa: E731
    push = jax.jit(jax.vmap(lambda d: jax.jvp(ready, (flat,), (d,))[1]))
    eye = jnp.eye(flat.size)
    eye = jnp.concatenate([eye, jnp.zeros((-flat.size % 13, flat.size))])
    chunks = [np.asarray(push(part)) for part in jnp.split(eye, eye.shape[0] // 13)]
    forward = np.concatenate(chunks)[: flat.size]
    np.testing.assert_allclose(forward, reverse, rtol=1e-8, atol=1e-14)


def test_forward_mode_alone_is_said(case):
    _, flat, function = case
    with pytest.raises(Exception, match="adjoint: .* knows no reverse mode: leave it out"):
        jax.eval_shape(jax.grad(lambda x: function(x, diffrax.ForwardMode())), flat)


def test_central_differences(case, value, reverse):
    """To 1e-6 of the gradient, or to what rounding leaves of the difference where a parameter hardly
    matters (the bound below: rounding of the scalar over the step)."""
    names, flat, _ = case
    values = np.asarray(flat)
    level = abs(float(value(flat)))
    worst, tested = [], 0
    for i, name in enumerate(names):
        size = abs(values[i])
        if name.endswith("inner_diameter") and size == 0:
            continue  # one-sided at zero, where its derivative is zero too: checked on shaft 2
        if name.endswith("angle") or name == "gravity":
            size = 1.0
        size = size or 1e-3
        # the scalar should move by a thousandth, the parameter by 2 % at most
        h = np.clip(1e-3 * level / (abs(reverse[i]) + 1e-300), 1e-4 * size, 2e-2 * size)

        def at(s, i=i, h=h):
            moved = values.copy()
            moved[i] += s * h
            return float(value(moved))

        # sixth-order differences: truncation is not what is compared
        central = (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * h)
        rounding = 5e-14 * level / h
        tolerance = 1e-6 * abs(reverse[i]) + rounding
        if abs(central - reverse[i]) > tolerance:
            worst.append(f"{name}: {reverse[i]:.9e} against {central:.9e}")
        tested += rounding < 1e-6 * abs(reverse[i])
    assert not worst, "\n".join(worst)
    assert tested > 50  # most of them are held to 1e-6 itself


def test_vmap_over_any_parameter(case, value):
    """A batch over all parameters at once is the single runs."""
    _, flat, function = case
    members = flat * (1 + 1e-3 * jnp.arange(3.0)[:, None])
    batch = np.asarray(jax.jit(jax.vmap(function))(members))
    single = [float(value(m)) for m in members]
    np.testing.assert_allclose(batch, single, rtol=1e-9)
    assert len(set(single)) == 3
