"""Three more example studies, each held against SciPy's integration of equations written here.

`rolling_mill`: four inertias, a current and a hysteresis. `test_bench_record`: a shaft of three
stations, its speed the record's. `clutch_bench`: two bodies that turn at two speeds. Every one is
run once, and audited once.
"""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator
from test_configs import RPM, Run, beam

ran = functools.cache(Run)


def whirls(run, name, want, part):
    """A station's r = x + i y and s = theta - i psi are as wanted, to a part of their peaks."""
    r = run(f"{name}.x") + 1j * run(f"{name}.y")
    s = run(f"{name}.theta") - 1j * run(f"{name}.psi")
    for got, expected in zip((r, s), want):
        peak = np.abs(expected).max()
        np.testing.assert_allclose(got, expected, rtol=0, atol=part * peak)


# The rolling stand


def rolling_mill(t_end):
    """The state's rates: four angles, four speeds, current, hysteresis."""
    J = np.array([12.0, 4, 1.5, 3])
    volts = PchipInterpolator([0, 0.02, 0.28, 0.55, 0.6], [0, 0, 170, 400, 400])
    necks = PchipInterpolator(
        [-60, -30, -5, 0, 5, 30, 60, 80], [150, 150, 100, 0, -100, -150, -240, -240]
    )
    x, f = np.array([0, 0.02, 0.04, 0.06, 0.10]), np.array([0, 900, 2100, 4000, 12000.0])
    rubber = PchipInterpolator([*-x[:0:-1], *x], [*-f[:0:-1], *f])

    def joint(d, v):
        def side(u):  # how deep, and how much of the face bears
            if u >= 2e-4:
                return u, 1.0
            return ((u + 2e-4) ** 2 / 8e-4, 0.5 * (1 + u / 2e-4)) if u > -2e-4 else (0.0, 0.0)

        def push(
            u, closing
        ):  # never below zero, rounded off where half of the spring's is taken away
            deep, on = side(u)
            spring = 2e5 * deep
            total, width = spring + 100 * on * closing, 0.5 * spring
            if total >= width:
                return total
            return (total + width) ** 2 / (4 * width) if total > -width else 0.0

        return push(d - 0.01, v) - push(-d - 0.01, -v)

    def rates(t, y, rolling):
        w, current, z = y[4:8], y[8], y[9]
        d, v = np.diff(y[:4]), np.diff(w)
        torques = [
            rubber(d[0]) + 40 * v[0] + 4e4 * 0.01 * z,
            3600 * np.tanh(v[1] / 0.2),
            joint(d[2], v[2]),
        ]
        on = np.array([*torques, 0]) - np.array([0, *torques])
        on[0] += 6.8 * current
        on[3] += necks(w[3]) - rolling
        electric = (volts(min(t, 0.6)) - 0.04 * current - 6.8 * w[0]) / 8e-4
        return [*w, *on / J, electric, (v[0] - 0.5 * abs(v[0]) * z - 0.5 * v[0] * abs(z)) / 0.01]

    edges = [0, 0.7, 0.9, 1.05, 1.25, t_end]
    y, pieces = np.zeros(10), []
    for k, (a, b) in enumerate(zip(edges[:-1], edges[1:])):
        bar = 2800.0 if k % 2 else 0.0
        piece = solve_ivp(
            rates, (a, b), y, "Radau", dense_output=True, args=(bar,), rtol=1e-8, atol=1e-9
        )
        y = piece.y[:, -1]
        pieces.append(piece.sol)
    return lambda t: np.stack([pieces[np.searchsorted(edges[1:-1], x, "right")](x) for x in t], 1)


def test_rolling_mill_bites_slips_and_rattles():
    run = ran("rolling_mill")
    want = rolling_mill(run.t[-1])(run.t)
    for k, name in enumerate(("motor", "flywheel", "spindle", "roll")):
        np.testing.assert_allclose(
            run(f"{name}.speed"), want[4 + k], rtol=0, atol=1e-6 * want[4].max()
        )
    np.testing.assert_allclose(run("armature.current"), want[8], rtol=0, atol=1e-6 * want[8].max())
    joint, clutch = run("joint.torque"), run("clutch.torque")
    # a bar's torque is overshot, the clutch slips at its capacity; let go, the joint rattles
    assert joint.min() < -1.2 * 2800
    assert clutch.min() == pytest.approx(-3600, rel=1e-3)
    after = joint[(run.t > 0.9) & (run.t < 1.05)]
    assert np.count_nonzero((after[1:] == 0) & (after[:-1] != 0)) >= 3


def test_rolling_mill_keeps_its_books():
    assert ran("rolling_mill").audit().relative < 1e-6


# The test bench: r and s at hub, disc and journal


def bench(t, record):
    """r and s of the stations, their angles, and the ring's, at the times t."""
    lateral = np.zeros((2, 6, 6))
    for k in (0, 2):
        K = beam(2.1e11, 8.1e10, 0.0, 0.03, 0.25, shear=False)[0]
        lateral[:, k : k + 4, k : k + 4] += np.stack([K, 2e-5 * K])
    lateral[:, 0, 0] += [2e7 + 1e5, 2000 + 20]
    lateral[:, 1, 1] += [50, 0.1]
    M = np.diag([3, 0.012, 8, 0.035, 1.5, 0.001])
    M[2:4, 2:4] += [[2, 2 * 0.04], [2 * 0.04, 0.0025 + 2 * 0.04**2]]
    polar = np.array([0.02, 0.064, 0.001])
    twist = 8.1e10 * np.pi * 0.03**4 / 32 / 0.25
    spring = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]]) * twist
    torsion = np.stack([spring, 2e-5 * spring])
    torsion[:, 0, 0] += [400, 0.1]
    weight = -9.81j * np.array([3, 0, 10, 2 * 0.04, 1.5, 0])
    inverse, rows = np.linalg.inv(M), np.array([0, 200, 500, 1100]) * RPM
    stiff = np.array([[[8, 2], [-4, 14]], [[6, 1], [-2, 9]], [[4, 0.5], [-1, 5]]]) * 1e6
    damped = np.array([[[6, -1], [-1, 9]], [[5, -0.5], [-0.5, 7]], [[4, 0], [0, 5]]]) * 1e3
    stiff, damped = np.concatenate([stiff[:1], stiff]), np.concatenate([damped[:1], damped])
    film = [held(rows, x) for x in (stiff, damped)]
    speed = CubicSpline(*record, bc_type="natural")
    angle = speed.antiderivative()

    def oil(w, r, v):
        pull = -film[0](w) @ [r.real, r.imag] - film[1](w) @ [v.real, v.imag]
        return pull[0] + 1j * pull[1]

    def rates(t, y):
        u, v = y[:6], y[6:12]
        (phi, ring), (w, ring_t) = np.split(y[12:16].real, [3]), np.split(y[16:20].real, [3])
        ring, ring_t = ring[0], ring_t[0]
        elastic = -torsion[0] @ phi - torsion[1] @ w
        elastic[0] += 400 * angle(t) + 0.1 * speed(t)
        rubber = 45.4 * ring + 0.32 * ring_t
        torque = elastic + [rubber, 0, 0]
        a = torque / polar
        force = weight - lateral[0] @ u - lateral[1] @ v
        force[4] += oil(abs(w[2]), u[4], v[4])
        force[2] += 60 * np.cos(376.99112 * t)
        if 1.1 < t < 1.102:
            force[2] -= 0.5j * np.pi * 0.6 / 0.002 * np.sin(np.pi * (t - 1.1) / 0.002)
        s, s_t = u[1::2], v[1::2]
        force[1::2] += 1j * polar * (w * s_t + a * s.real) - 0.5j * torque * s.conj()
        return np.concatenate([v, inverse @ force, w, [ring_t], a, [-rubber / 0.0128 - a[0]]])

    # at rest under the weight and the shaker's first push, on the film of the lowest speed
    start, push = np.zeros(20, complex), weight + np.array([0, 0, 60, 0, 0, 0])
    real = np.kron(lateral[0], np.eye(2))
    real[8:10, 8:10] += stiff[0]
    start[:6] = np.linalg.solve(real, push.view(float)).view(complex)
    edges = [0, 1.1, 1.102, t[-1]]
    pieces = []
    for a, b in zip(edges[:-1], edges[1:]):
        at = t[(t >= a) & ((t < b) | (b == t[-1]))]
        piece = solve_ivp(rates, (a, b), start, "DOP853", rtol=1e-8, atol=1e-12, dense_output=True)
        start = piece.y[:, -1]
        pieces.append(piece.sol(at))
    return np.concatenate(pieces, axis=1)


def held(x, y):
    """SciPy's PCHIP, held at its end values outside."""
    curve = PchipInterpolator(x, y)
    return lambda at: curve(np.clip(at, x[0], x[-1]))


def test_bench_follows_its_record():
    run = ran("test_bench_record")
    profile = run.study.machine.elements()["engine"].profile
    record = np.asarray(profile.times), np.asarray(profile.speeds)
    want = bench(run.t, record)
    for k, name in enumerate(("hub", "disc", "journal")):
        speed = want[16 + k].real
        np.testing.assert_allclose(run(f"{name}.speed"), speed, rtol=0, atol=2e-6 * speed.max())
        whirls(run, name, want[2 * k : 2 * k + 2], 5e-5)
    ring = want[15].real
    np.testing.assert_allclose(run("damper.ring_angle"), ring, rtol=0, atol=1e-5 * np.ptp(ring))


def test_bench_keeps_its_books():
    assert ran("test_bench_record").audit().relative < 1e-6


# The clutch's bench: disc and yoke, each with r and s


def clutch_bench(t, speeds):
    a, L = 6e6, 0.2  # the plate as a beam, 12 EI/L³ and L: what of its matrix acts on the disc
    K, C = np.zeros((2, 4, 4))
    plate = a * np.array([[1, -L / 2], [-L / 2, L**2 / 3]])
    shaft = beam(2.1e11, 8.1e10, 0.0, 0.035, 0.3, shear=False)[0][:2, :2]
    joint = np.kron([[1, -1], [-1, 1]], np.diag([1e6, 300]))
    K[:2, :2], K[2:, 2:] = plate, shaft + np.diag([8e5, 0])
    C[:2, :2], C[2:, 2:] = 2e-4 * plate, 2e-4 * shaft + np.diag([800, 0])
    C_joint = np.kron([[1, -1], [-1, 1]], np.diag([200, 0.5]))
    K, C = K + joint, C + C_joint
    bored = 5e-5 * np.exp(1j * np.pi / 6) * np.array([1, 0, 0, 0])
    aside = joint @ np.array([0, 0, 1e-4j, 0])  # the right shaft's line lies aside
    twist = 8.1e10 * np.pi * 0.035**4 / 32 / 0.3
    angle = speeds.antiderivative()
    m, arm, e = 6.0, 0.02, 2e-4

    def rates(t, y):
        u, v, phi, w = y[:4], y[4:8], y[8:10].real, y[10:12].real
        carried = 150 * np.tanh((w[1] - w[0]) / 1.0)
        held = 2e4 * (157.07963267948966 * t - phi[0]) + 4 * (157.07963267948966 - w[0])
        driven = twist * (angle(t) - phi[1] + 2e-4 * (speeds(t) - w[1]))
        a = np.array([(held + carried) / 0.06, (driven - carried) / 0.035])
        turning = np.exp(1j * phi[0]) * bored
        force = -K @ (u - turning) - C @ (v - 1j * w[0] * turning) - aside
        # torques act about chi = phi + psi theta/2
        force[1] += -0.5j * (held + carried) * u[1].conj()
        force[3] += -0.5j * (driven - carried) * u[3].conj()
        disc = [force[0] / 8, (force[1] + 1j * 0.06 * (w[0] * v[1] + a[0] * u[1].real)) / 0.035]
        # the yoke: centre r, mass centre r + arm s + e exp(i phi); (psi, theta) of its tensor
        c, s = np.cos(2 * phi[1]), np.sin(2 * phi[1])
        wide, narrow = 0.021 * np.eye(2), 0.009
        J = wide + narrow * np.array([[c, s], [s, -c]])
        J_t = 2 * w[1] * narrow * np.array([[-s, c], [c, s]])
        rate = np.array([-v[3].imag, v[3].real])
        moment = np.array([-force[3].imag, force[3].real])
        gyro = 0.035 * np.array([w[1] * rate[1] + a[1] * u[3].real, -w[1] * rate[0]])
        right = moment - J_t @ rate - gyro
        thrown = e * np.exp(1j * phi[1]) * (w[1] ** 2 - 1j * a[1])
        # x'' + arm theta'' and y'' - arm psi'', and the moments of m times them about the centre
        big = np.zeros((4, 4))
        big[0, 0] = big[1, 1] = m
        big[0, 3] = big[3, 0] = m * arm
        big[1, 2] = big[2, 1] = -m * arm
        big[2:, 2:] = J + m * arm**2 * np.eye(2)
        out = np.array([force[2].real, force[2].imag, *right])
        out += m * np.array([thrown.real, thrown.imag, -arm * thrown.imag, arm * thrown.real])
        x, yy, psi, theta = np.linalg.solve(big, out)
        return np.concatenate([v, disc, [x + 1j * yy, theta - 1j * psi], w, a])

    start = np.zeros(12, complex)
    start[10:] = 1500 * RPM
    return solve_ivp(rates, (0, t[-1]), start, "DOP853", t, rtol=1e-8, atol=1e-12).y


def test_clutch_bench_slips_and_beats():
    run = ran("clutch_bench")
    rows = np.array([1500, 1500, 1200, 1200, 1500]) * RPM
    speeds = PchipInterpolator([0, 0.1, 0.3, 0.6, 0.75], rows)
    speeds.extend(np.array([[0.0], [0.0], [0.0], [rows[-1]]]), np.array([2.0]))  # held beyond
    want = clutch_bench(run.t, speeds)
    for k, name in enumerate(("disc", "yoke")):
        speed = want[10 + k].real
        np.testing.assert_allclose(run(f"{name}.speed"), speed, rtol=0, atol=1e-5 * speed.max())
        whirls(run, name, want[2 * k : 2 * k + 2], 2e-5)
    # held slipping, the clutch passes all of its capacity on; the rest of the power is heat
    slipping = (run.t > 0.4) & (run.t < 0.55)
    power = run("engine.power")[slipping].mean() + run("vehicle.power")[slipping].mean()
    assert power == pytest.approx(150 * 300 * RPM, rel=1e-5)


def test_clutch_bench_keeps_its_books():
    assert ran("clutch_bench").audit().relative < 1e-6
