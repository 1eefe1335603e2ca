"""Given motions and schedules: against quadrature and differences; a jump between samples."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

import jaxrotor as jr
from jaxrotor.profiles.motion import differentiate

TIMES, SPEEDS = (0.2, 0.5, 0.9, 1.0, 1.8, 2.5), (10.0, 40.0, 45.0, 45.0, 30.0, 80.0)
PCHIP = PchipInterpolator(TIMES, SPEEDS)

# profile, its speed as anybody would write it, where its acceleration jumps or kinks
PROFILES = {
    "constant": (jr.ConstantSpeed(-7.0), lambda t: -7.0, []),
    "cosine": (
        jr.CosineRamp(speed=100.0, duration=2.0),
        lambda t: 0 if t < 0 else 100 if t > 2 else 50 * (1 - np.cos(np.pi * t / 2)),
        [2.0],  # a kink
    ),
    "linear": (
        jr.LinearRamp(speed=100.0, duration=2.0),
        lambda t: 50 * np.clip(t, 0, 2),
        [0.0, 2.0],
    ),
    "braking": (
        jr.LinearRamp(speed=-20.0, duration=1.5, start=60.0),
        lambda t: 60 - 80 / 1.5 * np.clip(t, 0, 1.5),
        [0.0, 1.5],
    ),
    "table": (
        jr.SpeedTable(TIMES, SPEEDS),
        lambda t: PCHIP(np.clip(t, TIMES[0], TIMES[-1])),
        [0.2, 2.5],
    ),
}
each_profile = pytest.mark.parametrize("name", PROFILES)


def motion(profile, times):
    """Position, speed and acceleration at many times."""
    return map(np.asarray, _motion(profile, jnp.asarray(times)))


@eqx.filter_jit
def _motion(profile, times):
    return jax.vmap(lambda t: differentiate(profile.position, t))(times)


@each_profile
def test_position_is_the_integral_of_the_speed(name):
    profile, speed, jumps = PROFILES[name]
    times = np.concatenate([np.linspace(-0.5, 3.1, 37), TIMES, [0.0, 1.5, 2.0]])
    p, v, a = motion(profile, times)
    np.testing.assert_allclose(v, [speed(t) for t in times], rtol=1e-12, atol=1e-12)
    position = jax.jit(lambda t: profile.position(t))
    rate = jax.jit(jax.grad(lambda t: profile.position(t)))
    origin = float(position(0.0))
    if name != "table":
        assert origin == 0.0
    for t, value in zip(times, p):
        corners = sorted(x for x in (*TIMES, 1.5, 2.0) if 0 < x < t)
        area, _ = quad(rate, 0, t, points=corners or None)
        np.testing.assert_allclose(value - origin, area, rtol=1e-10, atol=1e-10)


@each_profile
def test_speed_and_acceleration_are_the_differences(name):
    profile, _, jumps = PROFILES[name]
    known = np.array([*TIMES, 0.0, 1.5, 2.0])
    times = np.linspace(-0.41, 3.07, 53)
    h = 1e-3
    times = times[np.min(np.abs(times[:, None] - known), axis=1) > 4 * h]
    values = [motion(profile, times + k * h) for k in (-2, -1, 0, 1, 2)]
    (p0, *_), (p1, *_), (_, v, a), (p3, *_), (p4, *_) = values
    np.testing.assert_allclose(v, (p0 - 8 * p1 + 8 * p3 - p4) / (12 * h), rtol=1e-8, atol=1e-8)
    (_, v0, _), (_, v1, _), (_, v3, _), (_, v4, _) = (
        motion(profile, times + k * h) for k in (-2, -1, 1, 2)
    )
    np.testing.assert_allclose(a, (v0 - 8 * v1 + 8 * v3 - v4) / (12 * h), rtol=1e-7, atol=1e-7)


@each_profile
def test_acceleration_jumps_only_where_said(name):
    profile, _, expected = PROFILES[name]
    np.testing.assert_allclose(np.sort(profile.jumps()), expected)
    for t in (*TIMES, 0.0, 1.5, 2.0):
        _, v, a = motion(profile, np.array([t - 1e-9, t, t + 1e-9]))
        assert np.ptp(v) < 1e-6  # the speed never jumps
        # neither side's acceleration is halved at the instant itself, as a clip's derivative would be
        assert min(abs(a[1] - a[0]), abs(a[1] - a[2])) < 1e-5
        # and it is continuous but for what is said
        assert (abs(a[2] - a[0]) > 1) == (t in expected and name != "cosine"), t


def test_table_is_met_monotone_and_smooth():
    table, _, _ = PROFILES["table"]
    _, v, _ = motion(table, np.array(TIMES))
    np.testing.assert_allclose(v, SPEEDS, rtol=1e-12)
    dense = np.linspace(-1, 4, 4001)
    _, v, a = motion(table, dense)
    assert np.all(v[dense < TIMES[0]] == SPEEDS[0]) and np.all(v[dense > TIMES[-1]] == SPEEDS[-1])
    for t0, t1, w0, w1 in zip(TIMES, TIMES[1:], SPEEDS, SPEEDS[1:]):
        inside = v[(dense >= t0) & (dense <= t1)]
        assert np.all(inside >= min(w0, w1) - 1e-9) and np.all(inside <= max(w0, w1) + 1e-9)
        steps = np.diff(inside) * np.sign(w1 - w0)
        assert np.all(steps >= -1e-9)  # it never turns back between two rows
    # continuous inside: one step of a dense grid moves it little
    between = a[(dense > TIMES[0]) & (dense < TIMES[-1])]
    assert np.max(np.abs(np.diff(between))) < 5.0
    assert np.max(np.abs(a)) > 100


def test_two_rows_are_a_linear_ramp():
    table, ramp = jr.SpeedTable([0.0, 3.5], [50.0, 500.0]), jr.LinearRamp(500.0, 3.5, 50.0)
    for found, wanted in zip(
        motion(table, np.linspace(-0.1, 4, 83)), motion(ramp, np.linspace(-0.1, 4, 83))
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-12)
    assert float(jax.jvp(table.position, (1.0,), (1.0,))[1]) == pytest.approx(50 + 450 / 3.5)


@pytest.mark.parametrize("name", ["cosine", "linear", "table"])
def test_motion_differentiates_by_its_numbers(name):
    profile, _, _ = PROFILES[name]
    leaves, tree = jax.tree.flatten(profile)
    ends = np.cumsum([x.size for x in leaves])[:-1]

    def values(x):
        parts = [p.reshape(leaf.shape) for p, leaf in zip(jnp.split(x, ends), leaves)]
        own = jax.tree.unflatten(tree, parts)
        times = jnp.array([0.37, 0.95, 1.7, 2.9])
        return jnp.stack(jax.vmap(lambda t: differentiate(own.position, t))(times))

    x = jnp.concatenate([x.ravel() for x in leaves])
    if name == "linear":
        x = x.at[-1].set(5.0)
    if name == "table":
        x = x.at[9].set(47.0)  # a level piece is a corner of the monotone slopes: no one derivative
    assert_derivatives_agree(values, x, rtol=1e-7, step=1e-4)


def test_schedules():
    step = jr.Step(0.5, 3.0, 1.0)
    assert [float(step.value(t)) for t in (0.0, 0.4999, 0.5, 9.0)] == [1.0, 1.0, 3.0, 3.0]
    np.testing.assert_array_equal(step.jumps(), [0.5])
    assert float(jr.Step(0.5, 3.0).value(0.0)) == 0.0
    assert float(jr.Steady(4.0).value(7.0)) == 4.0 and jr.Steady(4.0).jumps().size == 0
    assert float(jr.Torque(2.5).value.value(1.0)) == 2.5
    push = jr.Force(jr.Step(0.5, 3.0), direction=(0, 0, -2.0))
    (force,) = push.forces(jnp.asarray(0.6), None, None)
    np.testing.assert_array_equal(force, [0, 0, -6.0, 0, 0, 0])


# A torque that jumps off the sample grid, on a free rotor: phi is a parabola, then another.

J, BEFORE, AFTER = 0.02, 0.3, -1.7
AT, RATE, END = np.pi / 31, 100.0, 0.25  # 0.1013417: between two samples


def after_jump(at, solver=None):
    torque = jr.Torque(jr.Step(at, AFTER, BEFORE))
    machine = jr.Machine({"r": jr.Rotor(1.0, J, 0.012), "t": torque}, {"t": "r"})
    return jr.simulate(machine, END, RATE, initial="undeformed", solver=solver, step=1 / RATE)


def exact(t, at):
    late = np.maximum(t - at, 0)
    speed = (BEFORE * np.minimum(t, at) + AFTER * late) / J
    before = BEFORE * np.minimum(t, at) ** 2 / 2
    return (before + BEFORE * at * late + AFTER * late**2 / 2) / J, speed


@pytest.mark.parametrize(
    "solver", [None, jr.ETD4RK(), diffrax.Dopri5()], ids=["default", "etd4rk", "dopri5"]
)
def test_a_jump_between_samples_is_met_exactly(solver):
    run = after_jump(AT, solver)
    phi, speed = exact(np.asarray(run.t), AT)
    np.testing.assert_allclose(run["r"].phi, phi, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["r"].velocity[:, 5], speed, rtol=0, atol=1e-12)
    assert abs(AT * RATE - round(AT * RATE)) > 0.1


def test_derivative_by_the_instant_of_a_jump():
    """d(phi)/d(at) = (before - after) (t - at)/J, and of the speed (before - after)/J."""

    def final(at):
        return after_jump(at, jr.ETD4RK()).y[-1][jnp.array([5, 11])]

    expected = [(BEFORE - AFTER) * (END - AT) / J, (BEFORE - AFTER) / J]
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(final)(AT), expected, rtol=1e-12)


@pytest.mark.parametrize("at", [-0.5, 0.0, 0.1, 0.25, 0.7])
def test_jumps_at_the_ends_outside_and_on_a_sample(at):
    run = after_jump(at, jr.ETD4RK())
    t = np.asarray(run.t)
    phi, speed = exact(t, at) if at > 0 else (AFTER * t**2 / 2 / J, AFTER * t / J)
    np.testing.assert_allclose(run["r"].phi, phi, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["r"].velocity[:, 5], speed, rtol=0, atol=1e-12)
