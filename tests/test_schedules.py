"""Schedules and the speed spline: against scipy, quadrature, and rotors that they drive."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart
from helpers import assert_derivatives_agree
from scipy.integrate import quad
from scipy.interpolate import (
    CubicSpline,
    PchipInterpolator,
    make_smoothing_spline,
)

import jaxrotor as jr
from jaxrotor.profiles.monotone import interpolate
from jaxrotor.profiles.motion import differentiate

TIMES = np.array([0.02, 0.05, 0.09, 0.1, 0.18, 0.25])
VALUES = np.array([1.0, 4.0, 4.5, 3.0, -3.0, 8.0])


def monotone(x, y):
    """SciPy's PCHIP, held at its end values outside."""
    curve = PchipInterpolator(x, y)
    return lambda at: curve(np.clip(at, x[0], x[-1]))


# schedule, the same as anybody would write it, and where it jumps or kinks
SCHEDULES = {
    "ramp": (
        jr.Ramp(0.05, 0.1, 3.0, -1.0),
        lambda t: np.interp(t, [0.05, 0.15], [-1.0, 3.0]),
        [0.05, 0.15],
    ),
    "table": (jr.Table(TIMES, VALUES), monotone(TIMES, VALUES), TIMES[[0, -1]]),
    "pulses": (
        jr.PulseTrain(0.07, 0.03, 5.0, -2.0, 0.013, count=3),
        lambda t: -2.0 + 7.0 * any(0.013 + k * 0.07 <= t < 0.043 + k * 0.07 for k in range(3)),
        [0.013, 0.043, 0.083, 0.113, 0.153, 0.183],
    ),
    "harmonic": (
        jr.Harmonic(0.4, [2.0, -0.7], [30.0, 71.0], [0.3, -1.1]),
        lambda t: 0.4 + (2 * np.exp(1j * (30 * t + 0.3)) - 0.7 * np.exp(1j * (71 * t - 1.1))).real,
        [],
    ),
    "impulse": (
        jr.Impulse(0.04, 0.05, 0.2),
        lambda t: 0.2 / 0.1 * np.pi * np.sin(np.pi * (t - 0.04) / 0.05) * (0.04 < t < 0.09),
        [0.04, 0.09],
    ),
}
each_schedule = pytest.mark.parametrize("name", SCHEDULES)


@each_schedule
def test_values_and_jumps(name):
    schedule, expected, jumps = SCHEDULES[name]
    times = np.concatenate([np.linspace(-0.1, 0.35, 91), TIMES, [0.013, 0.083, 0.153]])
    got = jax.jit(jax.vmap(schedule.value))(jnp.asarray(times))
    np.testing.assert_allclose(got, [expected(t) for t in times], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.sort(schedule.jumps()), jumps, rtol=1e-14)


def test_a_pulse_begins_and_ends_at_the_very_instants_that_it_lists():
    train = SCHEDULES["pulses"][0]
    edges = np.asarray(train.jumps())
    at = jax.vmap(train.value)
    assert np.all(at(edges[:3]) == 5.0) and np.all(at(edges[3:]) == -2.0)
    assert np.all(at(np.nextafter(edges[:3], 0)) == -2.0)
    assert np.all(at(np.nextafter(edges[3:], 0)) == 5.0)
    assert float(train.value(0.013 + 3 * 0.07 + 0.01)) == -2.0  # no fourth one


def test_default_phases_are_zero():
    both = jr.Harmonic(1.0, [2.0], [3.0]), jr.Harmonic(1.0, [2.0], [3.0], [0.0])
    got = [float(s.value(0.7)) for s in both]
    np.testing.assert_allclose(got, 1 + 2 * np.cos(2.1), rtol=1e-13)


@pytest.mark.parametrize("rows", [2, 3, 4])
def test_the_monotone_curve_takes_several_columns(rows):
    """Ends that turn back, that are kept monotone and that are not, and two rows: a straight line."""
    x = np.array([0.0, 1.0, 3.0, 4.0])[:rows]
    y = np.random.default_rng(rows).normal(size=(rows, 2, 3))
    for at in (-1.0, 0.0, 0.4, 1.0, 2.9, 4.0, 7.0):
        expected = [[monotone(x, y[:, i, j])(at) for j in range(3)] for i in range(2)]
        np.testing.assert_allclose(interpolate(x, y, jnp.asarray(at)), expected, atol=1e-14)


def values(tree, shapes, at):
    """The schedule's (or motion's) values as a function of its numbers in one vector."""
    ends = np.cumsum([x.size for x in shapes])[:-1]

    def function(x):
        parts = [p.reshape(s.shape) for p, s in zip(jnp.split(x, ends), shapes)]
        own = jax.tree.unflatten(tree, parts)
        if isinstance(own, jr.profiles.AbstractMotion):
            return jnp.stack(jax.vmap(lambda t: differentiate(own.position, t))(at))
        return jax.vmap(own.value)(at)

    return function


@pytest.mark.parametrize("name", [*SCHEDULES, "spline"])
def test_derivatives_by_every_number(name):
    spline = jr.SpeedSpline(TIMES, VALUES)
    leaves, tree = jax.tree.flatten(spline if name == "spline" else SCHEDULES[name][0])
    x = jnp.concatenate([jnp.ravel(leaf) for leaf in leaves])
    at = jnp.array([-0.01, 0.031, 0.0631, 0.0951, 0.137, 0.217, 0.31])
    derivative = assert_derivatives_agree(values(tree, leaves, at), x, rtol=1e-7, step=1e-4)
    # a pulse train and an impulse have edges, by which their values have no derivative
    zero = ~np.any(derivative != 0, axis=tuple(range(derivative.ndim - 1)))
    assert np.sum(zero) == (3 if name == "pulses" else 0)


# What drives a rotor of inertia J turns it by the area under the schedule: all in one machine.

J, END, RATE = 0.02, 0.25, 100.0


@pytest.fixture(scope="module")
def driven():
    machine = apart({name: jr.Torque(SCHEDULES[name][0]) for name in SCHEDULES}, J)
    return jr.simulate(machine, END, RATE, initial="undeformed", solver=diffrax.Dopri8(), step=1e-3)


@each_schedule
def test_a_rotor_gains_the_area_of_its_torque(name, driven):
    _, expected, jumps = SCHEDULES[name]
    speed = np.asarray(driven[name].velocity[:, 5])
    corners = sorted([*jumps, *(TIMES if name == "table" else [])])
    for t, w in zip(np.asarray(driven.t)[1:], speed[1:]):
        points = [c for c in corners if 0 < c < t] or None
        area, _ = quad(expected, 0, t, points=points, epsabs=1e-13, limit=200)
        np.testing.assert_allclose(w, area / J, rtol=1e-10, atol=1e-10)


def test_an_impulse_changes_the_speed_by_its_area_over_the_inertia(driven):
    speed = np.asarray(driven["impulse"].velocity[:, 5])
    assert np.max(np.abs(speed[:5])) < 1e-12
    np.testing.assert_allclose(speed[9:], 0.2 / J, rtol=1e-11)


# Spline


def test_spline_is_scipys_natural_cubic():
    spline = jr.SpeedSpline(TIMES, VALUES)
    oracle = CubicSpline(TIMES, VALUES, bc_type="natural")
    area = oracle.antiderivative()
    times = np.concatenate([np.linspace(TIMES[0], TIMES[-1], 57)[1:-1], TIMES[1:-1]])
    at = jax.jit(jax.vmap(lambda t: differentiate(spline.position, t)))
    p, v, a = at(jnp.asarray(times))
    origin = VALUES[0] * TIMES[0]
    np.testing.assert_allclose(p - origin, area(times) - area(TIMES[0]), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(v, oracle(times), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(a, oracle(times, 1), rtol=1e-10, atol=1e-10)
    # outside: the end speeds
    p, v, a = at(jnp.array([-0.5, 0.0, 0.3, 0.8]))
    np.testing.assert_allclose(v, VALUES[[0, 0, -1, -1]], rtol=1e-13)
    np.testing.assert_allclose(a, 0.0, atol=1e-13)
    end = origin + float(area(TIMES[-1]) - area(TIMES[0]))
    expected = [-0.5, 0.0, end + 8.0 * 0.05, end + 8.0 * 0.55]
    np.testing.assert_allclose(p, expected, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(spline.jumps(), TIMES[[0, -1]])


def test_the_torque_that_turns_a_rotor_along_a_spline():
    """The reaction is J times scipy's derivative of speed. (No coordinate is left to be solved for
    that moves: any solver does.)"""
    spline = jr.SpeedSpline(TIMES, VALUES)
    rotor = {"r": jr.Rotor(1.0, J, 0.012)}
    machine = jr.Machine.in_line(rotor, prescribed={"r": {"phi": spline}})
    run = jr.simulate(machine, 0.3, 500.0, "undeformed", solver=diffrax.Heun(), step=2e-3)
    t = np.asarray(run.t)
    inside = (t > TIMES[0]) & (t < TIMES[-1])
    expected = J * CubicSpline(TIMES, VALUES, bc_type="natural")(t, 1) * inside
    away = np.min(np.abs(t[:, None] - TIMES[[0, -1]]), axis=1) > 1e-9  # at the ends it jumps
    np.testing.assert_allclose(run["r"].reaction[away, 5], expected[away], rtol=0, atol=1e-10)
    assert np.max(np.abs(expected)) > 1


def record(noise):
    t = np.linspace(0, 3, 601)
    true = 100 * np.tanh(t) + 5 * np.sin(4 * t)
    return t, true, true + noise * np.random.default_rng(3).normal(size=t.size)


def speed_of(spline, t):
    return np.asarray(jax.vmap(lambda s: differentiate(spline.position, s)[1])(jnp.asarray(t)))


@pytest.mark.parametrize("lam", [None, 1e-3])
def test_a_noisy_record_is_smoothed_and_thinned(lam):
    t, true, noisy = record(2.0)
    spline = jr.SpeedSpline.smoothed(t, noisy, lam)
    got = speed_of(spline, t[1:-1])
    # scipy's own curve within a twentieth of the noise (of 2 rad/s) that was taken out
    whole = make_smoothing_spline(t, noisy, lam=lam)(t)
    assert np.max(np.abs(got - whole[1:-1])) < 0.055 * np.sqrt(np.mean((noisy - whole) ** 2))
    assert spline.times.size < 60
    # and near the truth: the mean error of the record itself is 2 rad/s
    assert np.sqrt(np.mean((got - true[1:-1]) ** 2)) < 0.5


def test_a_clean_record_is_followed():
    t, true, _ = record(0.0)
    spline = jr.SpeedSpline.smoothed(t, true, lam=0.0)
    np.testing.assert_allclose(speed_of(spline, t[1:-1]), true[1:-1], rtol=0, atol=1.1e-4)
    assert spline.times.size < 100


# Wrong input


def motion_machine(motion):
    return jr.Machine.in_line({"r": jr.Rotor(1.0, J, 0.01)}, prescribed={"r": {"phi": motion}})


def torque_machine(schedule):
    rotor = {"r": jr.Rotor(1.0, J, 0.012)}
    return jr.Machine.in_line(rotor, attachments={"m": (jr.Torque(schedule), "r")})


WRONG = {
    "`m`: value.duration must be positive, but is 0 s": jr.Ramp(0.0, 0.0, 1.0),
    "`m`: times and values must be equally long, two rows at least, but have 3 and 2": jr.Table(
        [0, 1, 2], [1, 2]
    ),
    "`m`: times must increase, but row 3 has 1 s after 2 s": jr.Table([0, 2, 1], [1, 2, 3]),
    "`m`: value.values must be finite, but is nan": jr.Table([0, 1, 2], [1, np.nan, 3]),
    "`m`: value.values must be a number, but is .*list": jr.Table([0, 1, 2], [1, [2, 3], 3]),
    "`m`: width must be less than the period, 2 s, but is 3 s": jr.PulseTrain(2.0, 3.0, 1.0),
    "amplitudes, frequencies and phases must be equally long, but have 2, 1 and 2": jr.Harmonic(
        0.0, [1, 2], [3]
    ),
    "`m`: value.duration must be positive, but is -1 s": jr.Impulse(0.0, -1.0, 1.0),
    "times and speeds must be equally long, three rows at least, but have 2 and 2": jr.SpeedSpline(
        [0, 1], [1, 2]
    ),
    "`r.phi`: times must increase, but row 2 has 0 s after 0 s": jr.SpeedSpline(
        [0, 0, 1], [1, 2, 3]
    ),
    "speeds must be finite, but is nan rad/s": jr.SpeedSpline([0, 1, 2], [1, np.nan, 3]),
}


@pytest.mark.parametrize("words", WRONG)
def test_wrong_schedules_are_refused(words):
    given = WRONG[words]
    machine = motion_machine if isinstance(given, jr.profiles.AbstractMotion) else torque_machine
    with pytest.raises(jr.InputError, match=words):
        jr.simulate(machine(given), 0.1, 10.0, solver=diffrax.Dopri8())


@pytest.mark.parametrize(
    "times, speeds, lam, words",
    [
        ([0, 1, 2, 3, 4, np.nan], np.ones(6), None, "row 6 is not finite, nan s and 1 rad/s"),
        ([0, 1, 2, 3, 4], [1, 2, 3, np.inf, 5], None, "row 4 is not finite, 3 s and inf rad/s"),
        ([0, 1, 1, 3, 4], np.ones(5), None, "times must increase, but row 3 has 1 s after 1 s"),
        ([0, 1, 2, 3], np.ones(4), None, "five rows at least"),
        ([0, 1, 2, 3, 4], np.ones(4), None, "equally long"),
        ([0, 1, 2, 3, 4], [1, 2, [3, 4], 5, 6], None, "must be lists of numbers"),
        ([0, 1, 2, 3, 4], np.ones(5), -1.0, "lam must be zero or positive, but is -1.0"),
    ],
)
def test_wrong_records_are_refused(times, speeds, lam, words):
    with pytest.raises(jr.InputError, match=f"SpeedSpline.smoothed: .*{words}"):
        jr.SpeedSpline.smoothed(times, speeds, lam)
