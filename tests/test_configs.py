"""The example studies: each is run, balanced, and held against a solution of its own kind.

The oracles are written here from textbook formulas, in NumPy and SciPy, with the figures of the
study files. One run and one energy audit a study; both at its own settings.
"""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eig, eigh
from scipy.optimize import brentq

import jaxrotor as jr

RPM = np.pi / 30


class Run:
    """A study, its response, and the samples of a part as NumPy arrays."""

    def __init__(self, name):
        self.study = jr.load(f"configs/{name}.toml")
        self.response = self.study.run(progress=False)
        self.t = np.asarray(self.response.t)

    def __call__(self, path):
        part, _, quantity = path.rpartition(".")
        return np.asarray(getattr(self.response[part], quantity))

    def audit(self, finer=1):
        """By steps as long as the run's, or so many times finer."""
        s, substeps = self.study.settings, self.response.info.substeps
        step = None if substeps is None else 1 / s.sample_rate / substeps / finer
        return jr.energy_audit(self.study.machine, s.t_end, s.sample_rate, s.initial, s.speed, step)


@functools.cache
def ran(name):
    return Run(name)


# A steady whirl of isotropic supports is one complex amplitude r = x + i y for each station, and one
# for its slope s = dr/dz = theta - i psi. A disc's gyroscopic moment then is -(Jt - Jp) W² s.


def beam(E, G, density, d, L, shear):
    """K, translational and rotary mass of an element over (r, s) of both ends: Timoshenko's beam with
    the shape functions of Przemieniecki; Cowper's shear coefficient."""
    A, I, nu = np.pi * d**2 / 4, np.pi * d**4 / 64, E / (2 * G) - 1
    kappa = 6 * (1 + nu) / (7 + 6 * nu)
    f = 12 * E * I / (kappa * G * A * L**2) if shear else 0.0
    K = np.array(
        [
            [12, 6 * L, -12, 6 * L],
            [6 * L, (4 + f) * L**2, -6 * L, (2 - f) * L**2],
            [-12, -6 * L, 12, -6 * L],
            [6 * L, (2 - f) * L**2, -6 * L, (4 + f) * L**2],
        ]
    ) * (E * I / (L**3 * (1 + f)))
    across, turning = np.zeros((4, 4)), np.zeros((4, 4))
    points, weights = np.polynomial.legendre.leggauss(5)
    for x, w in zip((points + 1) / 2, weights / 2):
        n = np.array(
            [
                1 - 3 * x**2 + 2 * x**3 + f * (1 - x),
                L * (x - 2 * x**2 + x**3 + f / 2 * (x - x**2)),
                3 * x**2 - 2 * x**3 + f * x,
                L * (-(x**2) + x**3 - f / 2 * (x - x**2)),
            ]
        ) / (1 + f)
        slope = np.array(
            [
                6 / L * (x**2 - x),
                1 - 4 * x + 3 * x**2 + f * (1 - x),
                6 / L * (x - x**2),
                3 * x**2 - 2 * x + f * x,
            ]
        ) / (1 + f)
        across += w * L * density * A * np.outer(n, n)
        turning += w * L * density * I * np.outer(slope, slope)
    return K, across, turning


def fitted(t, values, *rates):
    """Least squares of `values` by exp(rate t): the amplitudes, and the largest misfit."""
    basis = np.exp(np.outer(t, rates))
    found = np.linalg.lstsq(basis, values, rcond=None)[0]
    return found, np.abs(basis @ found - values).max()


# The overhung fan


def test_overhung_fan_whirls_as_stodola_says():
    run, W = ran("overhung_fan"), 3500 * RPM
    K, C = np.zeros((8, 8)), np.zeros((8, 8))  # wheel, front, rear, motor
    for k, (L, d) in enumerate(((0.26, 0.045), (0.55, 0.045), (0.15, 0.02))):
        own = slice(2 * k, 2 * k + 4)
        element = beam(2.1e11, 8.1e10, 0.0, d, L, shear=False)[0]
        K[own, own] += element
        C[own, own] += 3e-4 * element
    for k in (2, 4):
        K[k, k] += 5e7
        C[k, k] += 2e4
        C[k + 1, k + 1] += 2.0
    # a self-aligning bearing's tilting is without gyroscopic moment
    M = np.array([40, 1.25 - 2.4, 21, 0.08, 20, 0.08])
    free = slice(0, 6)  # the motor holds its end
    force = np.zeros(6)
    force[0] = 40 * 63e-6 * W**2
    amplitude = np.linalg.solve((K + 1j * W * C)[free, free] - W**2 * np.diag(M), force)
    late = run.t > 2.5
    t = run.t[late] - 1.0  # the ramp of 2 s has turned as far as 1 s at full speed
    for k, name in enumerate(("wheel", "front", "rear")):
        for j, values in (
            (0, run(f"{name}.x") + 1j * run(f"{name}.y")),
            (1, run(f"{name}.theta") - 1j * run(f"{name}.psi")),
        ):
            (_, found), _ = fitted(t, values[late], 0.0, 1j * W)
            assert abs(found - amplitude[2 * k + j]) < 1e-3 * abs(amplitude[2 * k + j]), name
    # without the gyroscopic moment it would be another whirl altogether
    M[1] = 1.25
    other = np.linalg.solve((K + 1j * W * C)[free, free] - W**2 * np.diag(M), force)
    assert abs(other[0] / amplitude[0] - 1) > 0.1


def test_overhung_fan_keeps_its_books():
    assert ran("overhung_fan").audit().relative < 1e-6


# The two-disc rotor of Friswell et al.


def two_disc():
    """M (translation and rotary), gyroscopic, K and C over (r, s) of seven nodes: the book's mesh."""
    M, gyro, K, C = np.zeros((4, 14, 14))
    for k in range(6):
        own = slice(2 * k, 2 * k + 4)
        element, across, turning = beam(2.11e11, 8.12e10, 7810.0, 0.05, 0.25, shear=True)
        K[own, own] += element
        C[own, own] += 2e-5 * element
        M[own, own] += across + turning
        gyro[own, own] += 2 * turning  # polar is twice diametral
    for node, d in ((2, 0.28), (4, 0.35)):
        m = 7810 * np.pi / 4 * (d**2 - 0.05**2) * 0.07
        M[2 * node, 2 * node] += m
        M[2 * node + 1, 2 * node + 1] += m * (3 * (d**2 + 0.05**2) / 4 + 0.07**2) / 12
        gyro[2 * node + 1, 2 * node + 1] += m * (d**2 + 0.05**2) / 8
    for k in (0, 12):
        K[k, k] += 1e6
        C[k, k] += 1500.0
    return M, gyro, K, C


def test_two_disc_rotor_whirls_as_its_matrices_say():
    M, gyro, K, C = two_disc()
    # the book's frequencies at rest: these are its matrices
    rest = np.sqrt(eigh(K, M, eigvals_only=True))
    np.testing.assert_allclose(rest[:3], [86.65811435, 274.31285391, 716.78631221], rtol=1e-8)

    run, W = ran("friswell_two_disc"), 400.0
    force = np.zeros(14, complex)
    for node, d, e in ((2, 0.28, 2e-5), (4, 0.35, 2e-5j)):
        force[2 * node] = 7810 * np.pi / 4 * (d**2 - 0.05**2) * 0.07 * e * W**2
    amplitude = np.linalg.solve(K + 1j * W * C - W**2 * (M - gyro), force)
    # what the run-up left rings down beside it, with the eight slowest roots of M, C - i W G, K
    zero, one = np.zeros((14, 14)), np.eye(14)
    roots = eig(
        np.block([[zero, one], [-K, -(C - 1j * W * gyro)]]), np.block([[one, zero], [zero, M]])
    )[0]
    slow = roots[np.argsort(np.abs(roots.imag))][:8]
    late = run.t > 3.3
    t = run.t[late] - 1.5
    for k, name in ((2, "disc 1"), (4, "disc 2")):
        values = (run(f"{name}.x") + 1j * run(f"{name}.y"))[late]
        (found, *_), misfit = fitted(t, values, 1j * W, *slow)
        assert abs(found - amplitude[2 * k]) < 1e-3 * abs(amplitude[2 * k])
        assert misfit < 1e-3 * abs(amplitude[2 * k])

    # the run-up, by the six slowest modes at rest of the same matrices
    shapes = eigh(K, M)[1][:, :6]
    k, c, g = (shapes.T @ x @ shapes for x in (K, C, gyro))
    f = shapes.T @ force / W**2

    def rates(t, y):
        r, v = y[:6], y[6:]
        w, alpha = W / 2 * (1 - np.cos(np.pi * t / 3)), W * np.pi / 6 * np.sin(np.pi * t / 3)
        phi = W / 2 * (t - 3 / np.pi * np.sin(np.pi * t / 3))
        push = f * (w**2 - 1j * alpha) * np.exp(1j * phi)
        return np.concatenate([v, push - k @ r - c @ v + 1j * w * (g @ v) + 0.5j * alpha * (g @ r)])

    up = run.t <= 3.0
    want = solve_ivp(
        rates, (0, 3), np.zeros(12, complex), "DOP853", run.t[up], rtol=1e-7, atol=1e-12
    ).y
    for node, name in ((2, "disc 1"), (4, "disc 2")):
        values = (run(f"{name}.x") + 1j * run(f"{name}.y"))[up]
        expected = shapes[2 * node] @ want[:6]
        peak = np.abs(expected).max()
        assert peak > 1.5 * abs(amplitude[2 * node])  # it does pass through resonance
        np.testing.assert_allclose(np.abs(values), np.abs(expected), atol=5e-3 * peak)


def test_two_disc_rotor_keeps_its_books():
    assert ran("friswell_two_disc").audit().relative < 1e-6


# The centrifuge


def test_centrifuge_is_braked_as_jeffcotts_rotor():
    run = ran("braking_through_critical")
    m, J, e, k, c = 30.0, 1.2, 1e-3, 2e5, 200.0

    def rates(t, y):
        z, phi, zt, w = y[0] + 1j * y[1], y[2], y[3] + 1j * y[4], y[5]
        brake = 90 * np.clip((t - 1) / 0.2, 0, 1) * np.tanh(w)
        force, arm = -k * z - c * zt, e * np.exp(1j * phi)
        # force acts at the centre, -arm from the mass centre: its moment, then the centre's motion
        wt = (-brake - (arm.conjugate() * force).imag) / J
        ztt = force / m + arm * (w**2 - 1j * wt)
        return [zt.real, zt.imag, w, ztt.real, ztt.imag, wt]

    want = solve_ivp(
        rates, (0, 4), [0, 0, 0, 0, 0, 2000 * RPM], "DOP853", run.t, rtol=1e-10, atol=1e-13,
        max_step=1e-2,
    ).y  # fmt: skip
    peak = np.hypot(want[0], want[1])[run.t > 1].max()
    assert peak > 7e-3  # seven times the eccentricity: it does pass through resonance
    np.testing.assert_allclose(run("basket.x"), want[0], rtol=0, atol=1e-5 * peak)
    np.testing.assert_allclose(run("basket.y"), want[1], rtol=0, atol=1e-5 * peak)
    np.testing.assert_allclose(run("basket.speed"), want[5], rtol=0, atol=1e-6 * want[5].max())
    # below resonance nothing but the brake slows it down
    below = (run.t > 3.6) & (run.t < 3.8)
    slope = np.polyfit(run.t[below], run("basket.speed")[below], 1)[0]
    assert slope == pytest.approx(-90 / J, rel=1e-2)


def test_centrifuge_keeps_its_books():
    assert ran("braking_through_critical").audit().relative < 1e-6


# The clutch


def kloss(speed, breakdown, slip, synchronous):
    s = 1 - speed / synchronous
    return 2 * breakdown * s * slip / (s**2 + slip**2)


def test_clutch_slips_by_coulombs_law_and_then_holds():
    run = ran("clutch_start")
    J1, J2, fan = 0.5, 0.8, 3.5e-3

    def motor(w):
        return kloss(w, 260.0, 0.2, 1500 * RPM)

    def slipping(t, y):  # speeds, and heat in the clutch
        carried = 160 * np.clip((t - 1) / 0.3, 0, 1)
        return [
            (motor(y[0]) - carried) / J1,
            (carried - fan * y[1] ** 2) / J2,
            carried * (y[0] - y[1]),
        ]

    def equal(t, y):
        return y[0] - y[1] if t > 1 else 1.0

    equal.terminal = True
    exact = dict(method="DOP853", rtol=1e-10, atol=1e-10, dense_output=True, max_step=1e-2)
    first = solve_ivp(slipping, (0, 3), [0, 0, 0], events=equal, **exact)
    (end,) = first.t_events[0]
    slips = run.t < end - 2e-3
    assert 1.9 < end < 2.2
    for k, name in enumerate(("flywheel", "machine")):
        want = first.sol(run.t[slips])[k]
        np.testing.assert_allclose(run(f"{name}.speed")[slips], want, atol=1e-5 * want.max())
    # joined from then on: the two as one
    w = first.y[0, -1]
    second = solve_ivp(lambda t, y: (motor(y) - fan * y**2) / (J1 + J2), (end, 3), [w], **exact)
    holds = run.t > end + 0.5
    for name in ("flywheel", "machine"):
        want = second.sol(run.t[holds])[0]
        np.testing.assert_allclose(run(f"{name}.speed")[holds], want, rtol=1e-4)
    # it does not creep while it holds: below capacity the twist stays
    twist = run("machine.phi") - run("flywheel.phi")
    assert np.ptp(twist[run.t > 2.8]) < 1e-6
    # the books, and the heat in them: less what the engaging clutch stores in its bent pads
    audit = run.audit()
    assert audit.relative < 1e-6
    assert float(audit.lost[-1]) == pytest.approx(first.y[2, -1], rel=1e-4)


# The geared fan


def test_geared_fan_runs_at_the_gears_ratio():
    run = ran("geared_train")
    r1, r2 = 0.5 * 2.5e-3 / np.cos(np.deg2rad(15.0)) * np.array([23, 67])
    fan = 0.105

    def surplus(w):  # at the motor: its torque less the fan's, through the gear
        return kloss(w, 255.0, 0.14, 1500 * RPM) - fan * (w * r1 / r2) ** 2 * r1 / r2

    speed = brentq(surplus, 1400 * RPM, 1499 * RPM, xtol=1e-12)
    # whole periods of the tooth mesh: the transmission error averages out
    period = 2 * np.pi / (23 * speed)
    last = run.t > run.t[-1] - 100 * period
    motor, out = run("motor.speed")[last].mean(), run("fan.speed")[last].mean()
    assert motor == pytest.approx(speed, rel=1e-5)
    assert out / motor == pytest.approx(-r1 / r2, rel=1e-6)
    # along the line of action, which leans by the pressure angle and the helix
    pressure = np.arctan(np.tan(np.deg2rad(20.0)) / np.cos(np.deg2rad(15.0)))
    helix = np.arctan(np.tan(np.deg2rad(15.0)) * np.cos(pressure))  # of the flank's normal
    force = fan * (speed * r1 / r2) ** 2 / (r2 * np.cos(pressure) * np.cos(helix))
    teeth = run("mesh.tooth_force")[last]
    assert teeth.mean() == pytest.approx(force, rel=1e-4)
    # teeth meet at 23 times the motor's speed: that is the largest line in the force
    lines = np.abs(np.fft.rfft((teeth - teeth.mean()) * np.hanning(len(teeth))))
    found = np.fft.rfftfreq(len(teeth), run.t[1])[np.argmax(lines)]
    assert found == pytest.approx(1 / period, abs=1.0 / (len(teeth) * run.t[1]))


def test_geared_fan_keeps_its_books():
    assert ran("geared_train").audit().relative < 1e-6


# The pump set


def test_pump_set_finds_its_operating_point():
    run = ran("motor_coupling_pump")
    w1, volts, pump = 2 * np.pi * 60, 179.63, 3.6e-4

    def circuit(w):
        """Torque and stator current (peak) of the steady equivalent circuit."""
        rotor = 0.816 / (1 - 2 * w / w1) + 2e-3j * w1
        inner = 69.31e-3j * w1
        total = 0.435 + 2e-3j * w1 + rotor * inner / (rotor + inner)
        stator = volts / total
        through = stator * inner / (rotor + inner)
        return 1.5 * abs(through) ** 2 * rotor.real / (w1 / 2), abs(stator)

    speed = brentq(lambda w: circuit(w)[0] - pump * w**2, 0.9 * w1 / 2, 0.9999 * w1 / 2)
    last = run.t > 1.3
    for name in ("motor", "impeller"):
        assert run(f"{name}.speed")[last].mean() == pytest.approx(speed, rel=1e-5)
    assert run("grid.torque")[last].mean() == pytest.approx(pump * speed**2, rel=1e-4)
    assert run("grid.current")[last].mean() == pytest.approx(circuit(speed)[1], rel=1e-4)
    # what the coupling's laws pass on at rest of its twist: k1 x + k3 x^3, the Maxwell branch relaxed
    twist = (run("motor.phi") - run("hub.phi"))[last].mean()
    assert 350 * twist + 1.5e4 * twist**3 == pytest.approx(pump * speed**2, rel=1e-3)


def test_pump_set_is_switched_on_like_a_locked_motor():
    """The fluxes, in the frame of the stator here: while the rotor hardly turns."""
    run = ran("motor_coupling_pump")
    w1, L, m = 2 * np.pi * 60, 71.31e-3, 69.31e-3
    inverse = np.linalg.inv([[L, m], [m, L]])
    speed = (run.t, run("motor.speed"))

    def rates(t, y):
        i = inverse @ y
        u = 179.63 * np.exp(1j * w1 * t)
        turning = 2j * np.interp(t, *speed) * y[1]
        return [u - 0.435 * i[0], -0.816 * i[1] + turning]

    on = run.t >= 0.05
    flux = solve_ivp(
        rates, (0.05, 0.5), [0j, 0j], "DOP853", run.t[on & (run.t < 0.5)], rtol=1e-9, atol=1e-12
    ).y
    current = (inverse @ flux)[0]
    torque = 1.5 * 2 * (flux[0].conjugate() * current).imag
    got = run("grid.torque")[on & (run.t < 0.5)]
    assert torque.max() > 50 and torque.min() < 0
    np.testing.assert_allclose(got, torque, atol=1e-4 * torque.max())
    # it swings at the grid's frequency
    swing = torque[: int(0.1 / run.t[1])]
    lines = np.abs(np.fft.rfft(swing - swing.mean()))
    assert np.fft.rfftfreq(len(swing), run.t[1])[np.argmax(lines)] == 60


def test_pump_set_keeps_its_books():
    assert ran("motor_coupling_pump").audit().relative < 1e-6


# The engine


def test_engine_twists_as_its_harmonics_say():
    """Harmonic balance: one complex amplitude a half order, the gas torque taken along the twist."""
    run, W = ran("engine_viscous_damper"), 3500 * RPM
    J = np.array([0.008, 0.012, 0.012, 0.012, 0.012, 0.22])
    springs = [2.4e5, 2.1e5, 2.1e5, 2.1e5, 2.9e5, 1500.0]
    dampers = [3.0, 3, 3, 3, 3, 8]
    K, C = np.zeros((2, 7, 7))
    for k in range(6):
        pair = np.ix_([k, k + 1], [k, k + 1])
        K[pair] += springs[k] * np.array([[1, -1], [-1, 1]])
        C[pair] += dampers[k] * np.array([[1, -1], [-1, 1]])
    K, C = K[:6, :6], C[:6, :6]  # the dynamometer holds its end
    orders = np.arange(1, 13) / 2
    sizes = np.array([58, 76, 77, 65, 52, 42, 33, 26, 20, 16, 12, 9.0])
    lags = np.deg2rad([30, 45, 55, 60, 65, 70, 75, 80, 85, 90, 95, 100])
    fires = np.pi * np.array([0, 3, 1, 2])  # 1-3-4-2: cylinder 2 comes last
    n = 256
    turned = 4 * np.pi * np.arange(n) / n  # a cycle is two turns
    halves = np.arange(n // 2 + 1) / 2

    def response(gas):
        out = np.zeros((6, n // 2 + 1), complex)
        for i, order in enumerate(halves[:60]):
            w = order * W
            Z = K + 1j * w * C - w**2 * np.diag(J)
            # the ring, driven through its oil: Jd x'' = c (hub' - x')
            Z[0, 0] += -(w**2) * 0.03 * 25j * w / (25j * w - w**2 * 0.03) if w else 0.0
            out[:, i] = np.linalg.solve(Z, gas[:, i])
        return out

    twist = np.zeros((6, n))
    for _ in range(30):
        angle = turned + twist[1:5] - fires[:, None]
        gas = 45 + np.einsum(
            "k,ktc->tc", sizes, np.cos(orders[:, None, None] * angle - lags[:, None, None])
        )
        torque = np.zeros((6, n))
        torque[1:5] = gas
        lines = response(np.fft.rfft(torque))
        twist, before = np.fft.irfft(lines, n), twist
    assert np.abs(twist - before).max() < 1e-12

    late = run.t > 2.2
    driven = run("dynamometer.phi")[late]
    weights = lines / n * np.where(halves > 0, 2, 1)
    waves = np.exp(1j * np.outer(halves, driven))
    for k, name in enumerate(["hub", *(f"cylinder {i}" for i in range(1, 5)), "flywheel"]):
        want = (weights[k] @ waves).real
        got = run(f"{name}.phi")[late] - driven
        np.testing.assert_allclose(got, want, atol=1e-4 * np.ptp(want))
    # the damper does what it is there for: it takes the twist of order 4 down to a tenth
    fourth = int(np.flatnonzero(halves == 4)[0])
    Z = K + 4j * W * C - (4 * W) ** 2 * np.diag(J)
    bare = np.linalg.solve(Z, np.fft.rfft(torque)[:, fourth])
    assert abs(bare[0] - bare[5]) > 10 * abs(lines[0, fourth] - lines[5, fourth])


def test_engine_keeps_its_books():
    # at the run's own step 2e-6 is left: harmonics up to the sixth order want finer ones
    assert ran("engine_viscous_damper").audit(finer=2).relative < 1e-6
