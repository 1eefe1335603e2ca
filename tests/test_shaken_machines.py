"""Whole runs of machines on ground that shakes, and on a measured foundation. Oracles: Chopra's book, SciPy,
the same block by its matrices, balance of energy, central differences."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from foundation_cases import MOUNT, MOUNT_C
from helpers import assert_derivatives_agree
from scipy.integrate import solve_ivp
from scipy.signal import lsim

import jaxrotor as jr

el, pr = jr.elements, jr.profiles
EL_CENTRO = Path(__file__).parent / "data" / "el_centro.at2"
MASS = 5.0


def single(base, frequencies, ratios):
    """One mass on a floor: x, y and z each an oscillator of its own (Hz, damping ratios)."""
    w = 2 * np.pi * np.array(frequencies)
    stiffness = [*(MASS * w**2), 9e3, 8e3, 10.0]
    damping = [*(2 * np.array(ratios) * w * MASS), 0.0, 0.0, 0.0]
    floor = el.MovingBase(base, [(0.0, 0.0, 0.0)], stiffness, damping)
    return jr.Machine(
        {"disc": jr.Rotor(MASS, 0.05, 0.03), "floor": floor}, {"floor": "disc"}, gravity=(0, 0, 0)
    )


def test_chopras_oscillators_in_el_centro():
    """Peak deformations of Chopra, Dynamics of Structures, fig. 6.4.1: periods of 1 and 2 s with 2 % damping,
    2 s with 5 %: 5.97, 7.47 and 5.37 inches. The step is planned."""
    record = jr.interop.read_accelerations(EL_CENTRO)
    base = el.BaseMotion(x=record, y=record, z=record)
    machine = single(base, (1.0, 0.5, 0.5), (0.02, 0.02, 0.05))
    run = jr.simulate(machine, 12.0, 100.0, initial="undeformed")
    against = np.asarray(run["disc"].position)[:, :3] - np.asarray(run["floor"].ground)
    inches = np.abs(against).max(axis=0) / 0.0254
    np.testing.assert_allclose(inches, [5.97, 7.47, 5.37], atol=0.006)
    assert float(run.info.error) <= 5e-5


def test_a_record_that_begins_quietly_is_planned_for():
    """Half a second of silence, then noise: the planned run meets its tolerance, of the motion against the
    ground, which is some thousandth of the ground's."""
    times = np.arange(0.0, 1.0, 0.01)
    values = np.random.default_rng(4).normal(size=times.size)
    values[times < 0.5], values[-1] = 0.0, 0.0
    machine = single(
        el.BaseMotion(x=pr.AccelerationRecord(times, values)), (60.0, 90.0, 60.0), (0.02,) * 3
    )
    run = jr.simulate(machine, 1.0, 50.0, initial="undeformed", speed=300.0)
    w = 2 * np.pi * 60.0
    fine = np.linspace(0.0, 1.0, 100001)
    ground = np.interp(fine, times, values) * (fine <= times[-1])
    wanted = lsim(([-1.0], [1.0, 2 * 0.02 * w, w**2]), ground, fine)[1][::2000]
    found = np.asarray(run["disc"].x) - np.asarray(run["floor"].ground)[:, 0]
    np.testing.assert_allclose(found, wanted, atol=5e-5 * np.abs(wanted).max())


def test_turns_beyond_first_order():
    wave = pr.HarmonicMotion([0.1], [0.1], rise=5.0)
    with pytest.raises(jr.InputError, match="phi must not exceed 0.02 rad.*comes to 0.1 rad"):
        single(el.BaseMotion(phi=wave), (10.0,) * 3, (0.1,) * 3)
    # a motion that does not know how far it goes is told by the run
    machine = single(el.BaseMotion(phi=pr.ConstantSpeed(1.0)), (10.0,) * 3, (0.1,) * 3)
    with pytest.warns(UserWarning, match="the ground turned by 0.1 rad"):
        jr.simulate(machine, 0.1, 100.0, initial="undeformed", step=0.01)


# A disc between a measured foundation and a floor that shakes


NATURAL, RATIO, MODAL_MASS = 30.0, 0.03, 40.0
SHAPE = np.array([1.0, 0.4])


def measured():
    """One mode in x and y, by its receptance."""
    f = np.linspace(5.0, 80.0, 200)
    g = (2 * np.pi) ** 2 * MODAL_MASS * (NATURAL**2 - f**2 + 2j * RATIO * NATURAL * f)
    fitted = jr.interop.fit_receptance(f, SHAPE[:, None] * SHAPE / g[:, None, None], 2, axes=2)
    assert fitted.passive
    return fitted.foundation(K1, C1)


K1, C1, K2, C2 = (np.append(x[:5], 0.0) for x in (MOUNT[0], MOUNT_C[0], MOUNT[1] / 10, MOUNT_C[1]))
SHAKE, PITCH, ARM = (1e-4, 9.0), (1e-6, 14.0), (0.0, -0.3, 0.1)
INERTIA, SPIN = np.array([40.0, 40.0, 40.0, 0.5, 0.5, 0.9]), 200.0
RUN = dict(sample_rate=2000.0, speed=SPIN, initial="undeformed", step=1.25e-4)


def between(foundation, size=1.0):
    shaking = el.BaseMotion(
        x=pr.HarmonicMotion(jnp.array([SHAKE[0]]) * size, [SHAKE[1]], rise=0.05),
        psi=pr.HarmonicMotion([PITCH[0]], [PITCH[1]], rise=0.05),
    )
    parts = {
        "disc": jr.Rotor(INERTIA[0], INERTIA[5], INERTIA[3]),
        "floor": el.MovingBase(shaking, [ARM], K2, C2),
        "structure": foundation,
    }
    return jr.Machine(parts, {"floor": "disc", "structure": "disc"}, gravity=(0, 0, 0))


def test_a_run_on_a_measured_foundation():
    """Against the mode itself, in NumPy, by DOP853."""
    grown = np.poly1d([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])

    def wave(t, size, frequency):
        s, w = min(t / 0.05, 1.0), 2 * np.pi * frequency
        u, v = size * np.sin(w * t), size * w * np.cos(w * t)
        return np.array([grown(s) * u, grown.deriv()(s) / 0.05 * u + grown(s) * v])

    def rates(t, y):
        q, v, a, a_t = y[:6], y[6:12], y[12], y[13]
        b, psi = np.zeros((2, 6)), wave(t, *PITCH)
        b[:, 0], b[:, 3] = wave(t, *SHAKE), psi
        b[:, 1], b[:, 2] = -ARM[2] * psi, ARM[1] * psi
        pull = K1 * (q - [*SHAPE * a, 0, 0, 0, 0]) + C1 * (v - [*SHAPE * a_t, 0, 0, 0, 0])
        force = -pull - K2 * (q - b[0]) - C2 * (v - b[1])
        force[3:5] += INERTIA[5] * SPIN * np.array([-v[4], v[3]])
        w = 2 * np.pi * NATURAL
        own = SHAPE @ pull[:2] / MODAL_MASS - 2 * RATIO * w * a_t - w**2 * a
        return [*v, *(force / INERTIA), a_t, own]

    run = jr.simulate(between(measured()), 0.1, **RUN)
    found = np.asarray(run["disc"].position)
    t = np.asarray(run.t)
    wanted = solve_ivp(rates, (0, t[-1]), np.zeros(14), "DOP853", t, rtol=1e-11, atol=1e-18).y.T
    for i in range(5):
        scale = np.abs(wanted[:, i]).max()
        np.testing.assert_allclose(found[:, i], wanted[:, i], atol=1e-6 * scale)


def test_energy_of_a_measured_foundation_closes():
    # standing still: a disc that turns has 18 kJ, whose rounding is some 1e-7 of what the ground gives
    audit = jr.energy_audit(between(measured()), 0.1, **RUN | {"speed": 0.0})
    assert audit.relative < 1e-11
    assert np.abs(audit.work_in).max() > 0.1 * audit.exchanged


def test_derivatives_of_a_run():
    e = measured()

    def end(x):
        own = el.MeasuredFoundation(
            e.A * x[0], e.B, e.C, e.stiffness * x[1], e.damping * x[2], axes=2
        )
        run = jr.simulate(between(own, x[3]), 0.02, **RUN | {"step": 5e-4})
        return run.y[-1, :4] * 1e5

    assert_derivatives_agree(end, [1.0, 1.0, 1.0, 1.0], step=1e-4)
