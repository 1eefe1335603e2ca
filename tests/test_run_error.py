"""A run judged by its own estimate of its error, against the true error from closed forms and SciPy."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import jaxrotor as jr

TOLERANCE = 5e-5  # of each coordinate's peak, what `plan` promises
WARNS = "estimate of its error"


def runs(machine, t_end, rate, steps, initial="static"):
    """By the plan, and with the given numbers of steps in a sample interval."""
    yield jr.simulate(machine, t_end, rate, initial)
    for n in steps:
        yield jr.simulate(machine, t_end, rate, initial, step=1 / rate / n)


def assert_told(run, found, exact, below, above=None):
    """The estimate is the true error, as part of the peak, within the factors `below` and `above`."""
    true = np.max(np.max(np.abs(found - exact), axis=0) / np.max(np.abs(exact), axis=0))
    assert true / below < run.stats["error"] < (above or below) * true
    if "pilot_error" in run.stats and run.stats["pilot_error"] >= 0:  # by the plan
        assert run.stats["error"] < TOLERANCE and true < TOLERANCE


def test_a_free_disc_nutates_on_the_cone():
    """Torque-free: its axis turns about the angular momentum at L/Jt, which no speed of the line tells."""
    Jp, Jt, spin, tilting = 0.01873, 0.01018, 1000.0, 20.0
    machine = jr.Machine.in_line({"disc": jr.Rotor(6.08, Jp, Jt)})
    velocity = np.zeros((1, 6))
    velocity[0, [3, 5]] = tilting, spin
    L = np.array([Jt * tilting, 0.0, Jp * spin])
    for run in runs(machine, 0.3, 1000.0, [8], jr.State(np.zeros((1, 6)), velocity)):
        turn = np.asarray(run.t)[:, None] * L / Jt
        axis = Rotation.from_rotvec(turn).apply([0.0, 0.0, 1.0])
        exact = np.stack(
            [-np.arcsin(axis[:, 1] / np.hypot(axis[:, 1], axis[:, 2])), np.arcsin(axis[:, 0])], 1
        )
        assert_told(run, np.asarray(run["disc"].position[:, 3:5]), exact, 1.5)


def vibration(t, w, damping, force, frequency):
    """x'' + 2 d x' + w² x = f cos(q t) from the place of rest under f, at rest."""
    damped = np.emath.sqrt(damping**2 - w**2)
    roots = -damping + damped, -damping - damped
    steady = force / (w**2 - frequency**2 + 2j * damping * frequency)
    x, v = force / w**2 - steady.real, -(1j * frequency * steady).real
    parts = np.linalg.solve([[1, 1], roots], np.array([x, v], complex))
    free = parts[0] * np.exp(roots[0] * t) + parts[1] * np.exp(roots[1] * t)
    return free.real + (steady * np.exp(1j * frequency * t)).real


def test_loads_faster_than_the_spin_are_followed():
    """A torque of 400 rad/s and forces of 3000 and 30 000 on a line that does not turn by itself."""
    q = {"phi": 400.0, "x": 3000.0, "y": 30000.0}
    waves = {axis: jr.Harmonic(0.0, [10.0], [frequency]) for axis, frequency in q.items()}
    support = jr.LinearSupport((2e5, 2e5, 0, 0, 0, 900.0), (10.0, 10.0, 0, 0, 0, 0.05))
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(2.0, 0.04, 0.03)},
        attachments={
            "support": (support, "disc"),
            "torque": (jr.Torque(waves["phi"]), "disc"),
            "push": (jr.Force(waves["x"], (1, 0, 0)), "disc"),
            "lift": (jr.Force(waves["y"], (0, 1, 0)), "disc"),
        },
        fixed={"disc": ("z", "psi", "theta")},
    )
    t, lateral = 1e-3 * np.arange(101), (np.sqrt(1e5), 2.5, 5.0)
    exact = [vibration(t, *lateral, q[axis]) for axis in "xy"]
    exact.append(vibration(t, np.sqrt(900 / 0.04), 0.05 / 0.08, 10 / 0.04, q["phi"]))
    exact = np.stack(exact, axis=1)
    plan = jr.plan(machine, 0.1, 1000.0)
    assert plan.excitation == q["y"] and plan.substeps == 32
    # not fitted to the fastest: on the safe side, for of what swings five times between samples the sense is
    # not told
    for substeps in (64, 96):
        plain = dataclasses.replace(plan, excitation=0.0, substeps=substeps)
        run = jr.simulate(machine, 0.1, 1000.0, step=plain)
        assert_told(run, np.asarray(run["disc"].position)[:, [0, 1, 5]], exact, 3, 300)
    run = jr.simulate(machine, 0.1, 1000.0)
    assert run.info.substeps == 32 and run.stats["error"] < 1e-7
    off = np.abs(np.asarray(run["disc"].position)[:, [0, 1, 5]] - exact)
    assert np.all(off < 1e-7 * np.max(np.abs(exact), axis=0))
    # its first steps, powers of time alone, are most of its error then, and no gap tells of them
    assert_told(run, np.asarray(run["disc"].position)[:, [0, 1, 5]], exact, 15)


def test_steps_are_fitted_to_an_excitation_far_above_the_spin():
    """A force of 300 rad/s on a disc that turns at 60 with an unbalance: in closed form, and a thousand times
    as near as when steps of the same length are fitted to the spin."""
    mass, k, c, e, spin, w = 2.0, 3.2e5, 40.0, 1e-4, 60.0, 300.0
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(mass, 0.01, 0.006, unbalance=jr.Unbalance(e))},
        attachments={
            "support": (jr.LinearSupport((k, k, 0, 0, 0, 0), (c, c, 0, 0, 0, 0)), "disc"),
            "push": (jr.Force(jr.Harmonic(0.0, [20.0], [w]), (1.0, 0.0, 0.0)), "disc"),
        },
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(spin)}},
    )
    d = c / mass / 2
    swing = np.sqrt(k / mass - d**2)

    def fading(t):
        return np.exp(-d * t) * (np.cos(swing * t) + d / swing * np.sin(swing * t))

    def error(run):
        t, pushes = np.asarray(run.t), ((20.0 / mass, w), (e * spin**2, spin))
        exact = sum(vibration(t, np.sqrt(k / mass), d, *push) for push in pushes)
        exact -= sum(f for f, _ in pushes) / (k / mass) * fading(t)  # from where nothing is bent
        return np.abs(run["disc"].x - exact).max() / np.abs(exact).max()

    run = jr.simulate(machine, 1.0, 200.0, "undeformed")
    assert run.info.substeps == 2
    assert error(run) < 1e-6 and 1 / 3 < run.stats["error"] / error(run) < 5
    plan = jr.plan(machine, 1.0, 200.0)
    assert plan.excitation == w and plan.substeps == 2
    plan = dataclasses.replace(plan, excitation=0.0)
    with pytest.warns(UserWarning, match=WARNS):
        other = jr.simulate(machine, 1.0, 200.0, "undeformed", step=plan)
    assert error(other) > 1e3 * error(run)


def test_an_unbalanced_rotor_through_its_criticals():
    """A disc on unlike springs, by SciPy; one step a sample is warned of by nobody, for it is fine."""
    mass, e, T, top = 5.0, 1e-4, 0.5, 500.0
    k, c = np.array([2e5, 3e5]), 40.0
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(mass, 0.05, 0.03, unbalance=jr.Unbalance(e))},
        attachments={
            "s": (jr.LinearSupport((*k, 2e5, 500.0, 600.0, 0), (c, c, c, 0.1, 0.1, 0)), "disc")
        },
        prescribed={"disc": {"phi": jr.CosineRamp(top, T)}},
    )

    def rates(t, y):
        s = min(t / T, 1.0)
        phi = top * (T / 2 * (s - np.sin(np.pi * s) / np.pi) + max(t - T, 0.0))
        w, a = top / 2 * (1 - np.cos(np.pi * s)), top / 2 * np.pi / T * np.sin(np.pi * s)
        turn = np.array([np.cos(phi), np.sin(phi)])
        push = e * (w**2 * turn - a * np.array([-turn[1], turn[0]]))
        return np.concatenate([y[2:], push - (k * y[:2] + c * y[2:]) / mass])

    t = np.arange(801) / 1000.0
    first = solve_ivp(rates, (0, T), np.zeros(4), "DOP853", t[t <= T], rtol=1e-12, atol=1e-16)
    after = solve_ivp(rates, (T, t[-1]), first.y[:, -1], "DOP853", t[t > T], rtol=1e-12, atol=1e-16)
    exact = np.concatenate([first.y, after.y], axis=1)[:2].T
    for run in runs(machine, 0.8, 1000.0, [1]):
        assert_told(run, np.asarray(run["disc"].position[:, :2]), exact, 10)


def test_a_step_too_long_says_so():
    """Sixty radians a step; and ten whole turns a step, which leave no trace in what the steps see."""
    support = jr.LinearSupport((2e5, 3e5, 2e5, 500.0, 600.0, 0), (40.0, 40.0, 40.0, 0.1, 0.1, 0))
    for speed in (3000.0, 20 * np.pi / 0.02):
        machine = jr.Machine.in_line(
            {"disc": jr.Rotor(5.0, 0.05, 0.03, unbalance=jr.Unbalance(1e-4))},
            attachments={"s": (support, "disc")},
            prescribed={"disc": {"phi": jr.ConstantSpeed(speed)}},
        )
        with pytest.warns(UserWarning, match=WARNS):
            jr.simulate(machine, 0.4, 50.0, step=0.02)


def test_no_whirl_in_an_undamped_resonance():
    support = jr.LinearSupport((2e6, 2e6, 2e6, 500.0, 500.0, 0), (0, 0, 0, 0.1, 0.1, 0))
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(2.0, 0.018, 0.01, unbalance=jr.Unbalance(1e-5))},
        attachments={"s": (support, "disc")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(1000.0)}},
    )
    with pytest.raises(
        jr.ConvergenceError, match="without damping a mode is in resonance at this speed"
    ):
        jr.simulate(machine, 0.02, 1000.0, initial="steady", step=1e-3)


class Wall(jr.AbstractAttachment):
    """A user's law with a hole: no number beyond `reach`."""

    reach: jnp.ndarray = jr.parameter("m")

    def forces(self, t, motions, state):
        ((q, _),) = motions
        return (-1e5 * jnp.sqrt(self.reach - q[0]) * q * jnp.array([1.0, 1, 1, 0, 0, 0]),)


@pytest.mark.parametrize(
    "reach, raised, solver",
    [
        (1e-4, jr.SimulationFailed, None),
        (1e-4, jr.SimulationFailed, jr.Rosenbrock()),
        (-1.0, jr.InputError, None),
    ],
)
def test_a_law_that_is_not_finite_is_named(reach, raised, solver):
    """Adaptive solvers end too: one of no length would be tried for ever, where no step is short enough."""
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(1.0, 0.01, 0.006)},
        attachments={
            "push": (jr.Force(jr.Ramp(0.0, 0.1, 50.0), (1.0, 0, 0)), "disc"),
            "wall": (Wall(reach), "disc"),
        },
        fixed={"disc": ("y", "z", "psi", "theta", "phi")},
    )
    with pytest.raises(raised, match="`wall`: .* is not finite .*mend its law") as found:
        step = 1e-3 if reach > 0 and solver is None else None
        jr.simulate(machine, 0.1, 1000.0, solver=solver, step=step)
    assert "smaller step" not in str(found.value)


def test_leaving_a_table_is_said_once():
    torque = jr.SpeedTorque([0.0, 10.0], [4.0, 1.0])
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(1.0, 0.01, 0.006)}, attachments={"motor": (torque, "disc")}
    )
    with pytest.warns(UserWarning, match="`motor`: its table ends at 0 and 10 rad/s") as told:
        run = jr.simulate(machine, 0.1, 1000.0, "undeformed", step=1e-3)
    assert len(told) == 1 and f"goes to {np.max(run['disc'].speed):.6g} rad/s" in str(
        told[0].message
    )
    # a straight line between two rows, then held: J w' = 4 - 0.3 w up to 10 rad/s
    at = np.log(4.0) / 30.0
    t = np.asarray(run.t)
    exact = np.where(t < at, (1 - np.exp(-30.0 * np.minimum(t, at))) * 40 / 3, 10 + 100 * (t - at))
    np.testing.assert_allclose(run["disc"].velocity[:, 5], exact, rtol=2e-4, atol=1e-9)
