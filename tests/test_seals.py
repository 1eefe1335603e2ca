"""Annular seals: coefficients from geometry and fluid against the nonlinear flow, Childs's printed formulas
and limits in closed form; inside machines against tables of their coefficients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, simpson
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.linear.linearise import models_at, models_over_speed
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble

# Childs, J. Lubr. Tech. 105 (1983) 429: interstage seal of the space shuttle's hydrogen pump
HPFTP = dict(
    diameter=0.0798,
    length=0.0432,
    clearance=1.397e-4,
    pressure_drop=14.92e6,
    viscosity=1.16e-5,
    density=70.78,
    friction=(0.066 * 2**0.25, -0.25),
)
SPEED = 37360 * np.pi / 30
# Kanki & Kawakami, IMechE (1984) 159: seals of water, by pressure and turning
WATER = dict(
    diameter=0.2,
    length=0.2,
    clearance=5e-4,
    pressure_drop=9.8e5,
    viscosity=8.779876e-4,
    density=996.8914,
    preswirl=0.2,
    inlet_loss=0.2,
)


def six(point):
    """K, k, C, c, M, m."""
    both = (point.stiffness, point.damping, point.mass)
    for x in both:
        assert x[0, 0] == x[1, 1] and x[0, 1] == -x[1, 0]
    return np.array([x[0, j] for x in both for j in (0, 1)])


# --- the short theory


def short_by_hand(swirl, speed=SPEED, R=0.0399, inertia=0.0, n=0.066, m=-0.25, loss=0.1):
    """K, k, C, c, M and the axial velocity by quadrature of the short seal's equations: no flow around the
    seal by the pressure; of the inertia of what w changes by at the inlet the part `inertia`."""
    L, H = 0.0432, 1.397e-4
    rho, nu, drop = 70.78, 1.16e-5 / 70.78, 14.92e6

    def factor(w):
        b = w / (R * speed)
        return n * (H * w / nu) ** m * (1 + 1 / (4 * b**2)) ** ((1 + m) / 2)

    w = brentq(
        lambda w: (1 + loss + 2 * factor(w) * L / H) * rho * w**2 / 2 - drop, 1.0, 1e4, xtol=1e-13
    )
    sigma, T, b = factor(w) * L / H, L / w, w / (R * speed)
    beta = 1 / (1 + 4 * b**2)
    a, B = sigma * (1 + beta * (1 + m)), 1 + 4 * b**2 * beta * (1 + m)
    z = np.linspace(0, 1, 2001)

    def force(whirl):
        x = 1j * T * (whirl - speed / 2 - swirl * speed * np.exp(-a * z))
        X = cumulative_simpson(x.imag, x=z, initial=0) * 1j
        XX = cumulative_simpson(X.imag, x=z, initial=0) * 1j
        # pressure without y0, its factor, and at the inlet -(1 + loss) y0
        rest = -X - sigma * (1 - m) * z - sigma * B * XX - X**2 / 2
        by_inlet = -(1 + loss) - sigma * B * z - inertia * X
        p = rest - by_inlet * rest[-1] / by_inlet[-1]
        return np.pi * R * L * rho * w**2 / H * simpson(p, x=z)

    still, ahead, back = (force(f) for f in (0.0, speed, -speed))
    M = (still - (ahead + back) / 2).real / speed**2
    around = (ahead - back) / (2 * speed)
    return np.array([still.real, -still.imag, around.imag, around.real, M]), w


@pytest.mark.parametrize("preswirl", [0.5, 0.1])
def test_short_seal_by_quadrature(preswirl):
    """Childs's formulas: as printed they leave out what K has of the swirl squared."""
    seal = jr.elements.AnnularSeal(**HPFTP, preswirl=preswirl, theory="short")
    found = seal.coefficients(SPEED)
    swirl = preswirl - 0.5
    expected, w = short_by_hand(swirl)
    h = 1e-3
    even = [short_by_hand(x)[0][0] for x in (h, -h, 0.0)]
    expected[0] = even[2] + (even[0] - even[1]) / (2 * h) * swirl
    assert float(found.velocity) == pytest.approx(w, rel=1e-10)
    np.testing.assert_allclose(six(found)[:5], expected, rtol=1e-7)
    leakage = np.pi * 0.0798 * 1.397e-4 * 70.78 * w
    assert float(found.leakage) == pytest.approx(leakage, rel=1e-10)


def test_black_and_jenssens_coefficients():
    """At a preswirl of a half: mu0, mu1 and mu2 of Black & Jenssen (1971) with Blasius's exponent,
    K = mu0 - mu2 (speed T)²/4, C = mu1 T, k = mu1 speed T/2, c = mu2 speed T², M = mu2 T²."""
    seal = jr.elements.AnnularSeal(**HPFTP, theory="short")
    found = seal.coefficients(SPEED)
    w, (R, L, H) = float(found.velocity), (0.0399, 0.0432, 1.397e-4)
    b, T, xi = w / (R * SPEED), L / w, 0.1
    sigma = (2 * 14.92e6 / (70.78 * w**2) - 1 - xi) / 2
    B, A = (1 + 7 * b**2) / (1 + 4 * b**2), np.pi * sigma / (1 + xi + 2 * sigma)
    E = (1 + xi) / (2 * (1 + xi + B * sigma))
    mu = [2.5 * A * E, 2 * A * (E / sigma + B / 2 * (E + 1 / 6)), A / sigma * (E + 1 / 6)]
    turn = SPEED * T
    expected = [
        mu[0] - mu[2] * turn**2 / 4,
        mu[1] * turn / 2,
        mu[1] * T,
        mu[2] * turn * T,
        mu[2] * T**2,
    ]
    expected = np.array(expected) * 14.92e6 * L * R / H
    np.testing.assert_allclose(six(found)[:5], expected, rtol=1e-9)


# --- the finite theory


def whirling_flow(given, speed, whirls, amplitude=2e-7, rows=10, columns=4):
    """-F/r of a rotor in circular whirls, by the NONLINEAR equations of the flow on a grid: polynomials along
    the seal, waves around it, in axes that whirl along; Newton's method."""
    R, L, H = given["diameter"] / 2, given["length"], given["clearance"]
    nu = given["viscosity"] / given["density"]
    z = (1 - np.cos(np.pi * np.arange(rows) / (rows - 1))) / 2
    powers = np.vander(z, increasing=True)
    along = np.zeros_like(powers)
    along[:, 1:] = powers[:, :-1] * np.arange(1, rows)
    along = np.linalg.solve(powers.T, along.T).T / L
    mean = np.linalg.solve(powers.T, 1 / np.arange(1, rows + 1))
    waves = np.fft.fftfreq(columns, 1 / columns) * (np.arange(columns) != columns // 2)
    around = np.fft.ifft(1j * waves[:, None] * np.fft.fft(np.eye(columns), axis=0), axis=0).real / R
    theta = 2 * np.pi * np.arange(columns) / columns
    h = H - amplitude * np.cos(theta)
    total = given["pressure_drop"] / given["density"]

    def slowed(law, w, u):
        n, m = law
        return n * (2 * h / nu) ** m * (w**2 + u**2) ** ((1 + m) / 2) / (2 * h)

    def residual(x, whirl):
        w, u, p = (
            x.reshape(3, rows, columns)
            * jnp.array([1.0, 1.0, total**0.5])[:, None, None]
            * (total**0.5)
        )

        def carried(f):
            return w * (along @ f) + (u - whirl * R) * (f @ around.T)

        slip = u - R * speed
        stator, rotor = slowed(given["friction"], w, u), slowed(given["rotor_friction"], w, slip)
        flow = along @ (h * w) + (h * (u - whirl * R)) @ around.T
        axial = carried(w) + along @ p + (stator + rotor) * w
        circular = carried(u) + p @ around.T + stator * u + rotor * slip
        inlet = p[0] - total + (1 + given["inlet_loss"]) * w[0] ** 2 / 2
        leaving = p[-1] + given["exit_recovery"] * w[-1] ** 2 / 2
        flow = flow.at[0].set(inlet / total**0.5 * H / L)
        axial = axial.at[0].set(leaving / L)
        circular = circular.at[0].set((u[0] - given["preswirl"] * R * speed) * total**0.5 / L)
        return jnp.stack([flow * total**0.5 / H, axial, circular]).ravel() * L / total

    both = quickly_compiled(lambda x, w: (residual(x, w), jax.jacfwd(residual)(x, w)))
    swirl = given["preswirl"] * R * speed / total**0.5
    x = np.stack(np.broadcast_arrays(1.0, swirl, (1 - z[:, None]) * np.ones(columns))).ravel()
    found = []
    for whirl in whirls:
        value = np.inf
        while np.abs(value).max() > 1e-12:
            value, slope = map(np.asarray, both(jnp.asarray(x), jnp.asarray(whirl)))
            x = x - np.linalg.solve(slope, value)
        p = mean @ x.reshape(3, rows, columns)[2] * given["pressure_drop"] * L
        found.append(2 * np.pi * R * np.mean(p * np.exp(1j * theta)) / amplitude)
    return np.array(found)


def test_finite_seal_by_the_nonlinear_flow():
    """Walls that differ, recovery at the exit, as long as wide: forces of a rotor whirling with a small
    amplitude, fitted alike."""
    given = WATER | dict(friction=(0.079, -0.25), rotor_friction=(0.12, -0.2), exit_recovery=0.3)
    speed = 200.0
    whirls = speed * np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    force = whirling_flow(given, speed, whirls)
    real, imaginary = (np.polyfit(whirls, x, 2)[::-1] for x in (force.real, force.imag))
    expected = [real[0], -imaginary[0], imaginary[1], real[1], -real[2], imaginary[2]]
    found = six(jr.elements.AnnularSeal(**given).coefficients(speed))
    # each by what it does to the force at the speed, of 2e7 N/m: the grid is off by 2e-4
    share = np.array([1, 1, speed, speed, speed**2, speed**2]) / np.abs(force).mean()
    np.testing.assert_allclose(found * share, expected * share, rtol=0, atol=3e-4)
    assert np.all(np.abs(found * share)[:5] > 0.05)


def test_finite_seal_is_the_short_one_where_its_diameter_is_large():
    """With the inertia that the printed formulas leave out; at the same velocity of the surface."""
    wide = 100.0
    seal = jr.elements.AnnularSeal(**HPFTP | dict(diameter=0.0798 * wide))
    found = seal.coefficients(SPEED / wide)
    expected, w = short_by_hand(0.0, SPEED / wide, 0.0399 * wide, inertia=1.0)
    assert float(found.velocity) == pytest.approx(w, rel=1e-8)
    # frequencies of the whirl are so low that M shows little
    np.testing.assert_allclose(six(found)[:4], expected[:4], rtol=1e-4)
    printed, _ = short_by_hand(0.0, SPEED / wide, 0.0399 * wide)
    assert abs(printed[2] / expected[2] - 1) > 0.2  # what they leave out is no trifle


def test_lomakins_stiffness_at_rest():
    """Where no flow turns around the seal, each angle has the pressure of its own gap."""
    wide = jr.elements.AnnularSeal(**HPFTP | dict(diameter=80.0))

    def mean_pressure(h):
        law = 0.066 * h**-0.25 * (70.78 / 1.16e-5) ** -0.25 * 0.0432 / h

        def velocity(w):
            return 70.78 * w**2 / 2 * (1.1 + 2 * law * w**-0.25) - 14.92e6

        w = brentq(velocity, 1.0, 1e4, xtol=1e-12)
        return (14.92e6 - 1.1 * 70.78 * w**2 / 2) / 2, w

    d = 1e-9
    slope = (mean_pressure(1.397e-4 + d)[0] - mean_pressure(1.397e-4 - d)[0]) / (2 * d)
    found = wide.coefficients(0.0)
    assert float(found.velocity) == pytest.approx(mean_pressure(1.397e-4)[1], rel=1e-9)
    assert float(found.stiffness[0, 0]) == pytest.approx(-np.pi * 40.0 * 0.0432 * slope, rel=1e-5)
    k, c = float(found.stiffness[0, 1]), float(found.damping[0, 1])
    assert abs(k) < 1e-7 * found.stiffness[0, 0] and abs(c) < 1e-5 * found.damping[0, 0]


def test_measured_seal_of_water():
    """Kanki & Kawakami's long seal at 2000 rpm: leakage 4634 cm3/s, (K, k) 3.6 and 10.8 MN/m, (C, c) 147 and
    55.3 kN s/m, means of both directions. The friction is what the leakage tells: 0.079 with Re of the
    clearance itself, with which another program (bulk_flow, T. Snyder 2020, 30 x 50 cells) has 4672.84 cm3/s.
    M is left out: 222 kg, and 318 here."""
    seal = jr.elements.AnnularSeal(**WATER, friction=(0.079 * 2**0.25, -0.25))
    found = seal.coefficients(2000 * np.pi / 30)
    assert float(found.leakage) / 996.8914 == pytest.approx(4672.84e-6, rel=2e-4)
    measured = [3.6e6, 10.8e6, 147e3, 55.3e3]
    np.testing.assert_allclose(six(found)[:4], measured, rtol=0.2)
    back = six(seal.coefficients(-2000 * np.pi / 30))
    np.testing.assert_allclose(back, six(found) * [1, -1, 1, -1, 1, -1], rtol=1e-12)


NAMES = "diameter length clearance pressure_drop viscosity density preswirl pressure_rise inlet_loss".split()
VALUES = np.array([0.2, 0.1, 4e-4, 4e5, 8e-4, 996.0, 0.3, 5.0, 0.2])


@pytest.mark.parametrize("theory", ["finite", "short"])
def test_slopes_of_coefficients(theory):
    """By each parameter and the speed: forward, reverse, central differences."""

    def value(x):
        seal = jr.elements.AnnularSeal(
            **dict(zip(NAMES, VALUES * (1 + x[:9]))), friction=jnp.array([0.08, -0.24]) * (1 + x[9])
        )
        found = seal.coefficients(300.0 * (1 + x[10]))
        parts = [found.stiffness / 1e7, found.damping / 1e5, found.mass / 30.0, found.leakage]
        return sum(
            jnp.sum((1.0 + jnp.arange(p.size)) * p.ravel() * 1.3**i) for i, p in enumerate(parts)
        )

    start, h = jnp.zeros(11), 1e-4
    both = quickly_compiled(lambda x: (value(x), jax.jacfwd(value)(x), jax.grad(value)(x)))
    _, forward, reverse = both(start)
    central = [
        (8 * (both(h * e)[0] - both(-h * e)[0]) - both(2 * h * e)[0] + both(-2 * h * e)[0])
        / (12 * h)
        for e in np.eye(11)
    ]
    assert np.all(np.abs(np.asarray(central)) > 1e-2)
    np.testing.assert_allclose(forward, central, rtol=1e-7)
    np.testing.assert_allclose(forward, reverse, rtol=1e-9)


# --- in machines


def pump(seal):
    """A disc that nothing else holds, so that little is compiled."""
    disc = jr.Rotor(100.0, 1.0, 0.6, jr.Unbalance(1e-5, 0.0))
    return jr.Machine({"disc": disc, "seal": seal}, {"seal": "disc"})


@pytest.fixture(scope="module")
def seal():
    return jr.elements.AnnularSeal(**dict(zip(NAMES, VALUES)))


@pytest.fixture(scope="module")
def machine(seal):
    return pump(seal)


def as_table(seal, speed):
    """The same coefficients at any speed."""
    point = seal.coefficients(speed)
    rows = [np.pad(np.asarray(x), (0, 4)) for x in (point.stiffness, point.damping, point.mass)]
    return jr.SpeedDependentSupport([0.0, 1.0], *([x, x] for x in rows))


CURVE = quickly_compiled(lambda seal: seal.prepared())
RATES = quickly_compiled(lambda m, y: vector_field(jnp.zeros(()), y, assemble(m)))


def test_rates_are_those_of_the_coefficients(seal, machine):
    """Of a deflected, moving rotor at some speeds, backward too: the curves of a solve are off by some
    millionths of what the seal does."""
    rng = np.random.default_rng(0)
    for speed in (0.0, 37.0, 251.0, -120.0, 2000.0):
        y = jnp.asarray(rng.uniform(-1e-3, 1e-3, 12)).at[11].set(speed)
        expected = RATES(pump(as_table(seal, abs(speed))), y)
        found = RATES(machine, y)
        if speed == 0.0:
            bare = RATES(pump(jr.LinearSupport(np.zeros(6))), y)
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=4e-6 * np.abs(expected - bare).max()
        )
        assert np.abs(expected - bare).max() > 1.0


@pytest.mark.parametrize("length", [0.01, 0.1, 0.4])
def test_curves_near_rest(length):
    """Short to long: some millionths. K may pass zero, and c is small beside C: each by what it may be."""
    seal = jr.elements.AnnularSeal(**dict(zip(NAMES, VALUES)) | dict(length=length))
    curve = CURVE(seal)
    for speed in (1e-3, 0.7, 11.0, 60.0):
        K, k, C, c, M, _ = six(seal.coefficients(speed))
        found = np.array(curve.at(jnp.asarray(speed)))[:5]
        sizes = np.array([K + C * speed, k, C, C, M])
        np.testing.assert_allclose(found / sizes, [K, k, C, c, M] / sizes, rtol=0, atol=5e-6)


def test_friction_much_quicker_than_the_flow():
    """A narrow seal, turned much too fast: the swirl settles at the inlet, and w is a root in closed form for
    walls alike. Curves, which reach to speeds that nobody runs at, are finite."""
    narrow = WATER | dict(clearance=2e-4, pressure_drop=1e5, inlet_loss=0.0)
    found = jr.elements.AnnularSeal(**narrow, friction=(0.079, -0.25)).coefficients(6000.0)

    rho, nu = 996.8914, 8.779876e-4 / 996.8914

    def left(w):
        V = np.hypot(w, 0.1 * 6000.0 / 2)
        return w**2 / 2 + 0.079 * (4e-4 * V / nu) ** -0.25 * V * w * 0.2 / 2e-4 - 1e5 / rho

    assert float(found.velocity) == pytest.approx(brentq(left, 1e-6, 1e2, xtol=1e-15), rel=1e-3)
    assert np.all(np.isfinite(CURVE(jr.elements.AnnularSeal(**narrow)).table))


def test_slopes_of_rates(machine):
    """By the clearance, the preswirl and the speed, along one direction."""
    y = jnp.asarray(np.random.default_rng(1).uniform(-1e-3, 1e-3, 12)).at[11].set(300.0)
    weights = np.random.default_rng(2).uniform(-1, 1, 12)
    way, h = jnp.array([1.0, -2.0, 30.0]), 1e-4

    def value(x):
        change = {"seal.clearance": 4e-4 * (1 + x[0]), "seal.preswirl": 0.3 * (1 + x[1])}
        rates = vector_field(jnp.zeros(()), y.at[11].add(x[2]), assemble(machine.set(change)))
        return weights @ rates

    both = quickly_compiled(lambda x: (*jax.jvp(value, (x,), (way,)), jax.grad(value)(x)))
    _, forward, reverse = both(jnp.zeros(3))
    central = (both(h * way)[0] - both(-h * way)[0]) / (2 * h)
    assert forward == pytest.approx(float(central), rel=1e-6)
    assert forward == pytest.approx(float(reverse @ way), rel=1e-9)


def test_diagrams_take_the_seal_at_each_speed(seal, machine):
    """Taken apart from the machine, exactly; and `support` has the same in its rows."""
    speeds = np.linspace(50.0, 400.0, 9)
    apart = models_over_speed(machine, speeds, "undeformed")
    table = seal.support(speeds)
    for i in (1, 5):
        same = as_table(seal, speeds[i])
        for name in ("stiffness", "damping", "mass"):
            np.testing.assert_allclose(getattr(table, name)[i], getattr(same, name)[0], rtol=1e-12)
        one, found = models_at(pump(same), "undeformed")(speeds[i]), apart(speeds[i])
        for name in ("M", "C", "K", "A"):
            a, b = np.asarray(getattr(found, name)), np.asarray(getattr(one, name))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max())


def spinning(speed):
    """Beside the middle, at a speed."""
    return jr.State(np.full((1, 6), 1e-4), np.array([[0.0] * 5 + [speed]]))


def test_books_close_and_a_run_tells_of_laminar_flow(machine):
    """The seal's work is a load's. At a hundredth of the pressure the flow is laminar."""
    audit = jr.energy_audit(machine, 0.02, 2000.0, spinning(300.0), step=1e-4)
    assert float(audit.relative) < 1e-7
    slow = machine.set({"seal.pressure_drop": 40.0})
    with pytest.warns(
        UserWarning, match="`seal`: its flow is turbulent from a Reynolds number of 2000"
    ):
        run = jr.simulate(slow, 0.02, 2000.0, spinning(10.0))
    numbers = run["seal"].reynolds_number
    gap = 2 * np.pi * 0.1 * 4e-4 * 996.0
    velocity = np.hypot(float(run["seal"].leakage[0]) / gap, 0.1 * 10.0 / 2)
    assert float(numbers[0]) == pytest.approx(2 * 4e-4 * velocity * 996.0 / 8e-4, rel=1e-9)


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(clearance=0.02), "clearance must be far smaller"),
        (dict(pressure_drop=-1.0), "pressure_drop must be positive"),
        (dict(exit_recovery=1.5), "exit_recovery must be at most 1"),
        (dict(friction=(0.079, 0.25)), "friction must be a positive n and an m between"),
        (dict(theory="long"), "theory must be 'finite' or 'short'"),
        (dict(theory="short", rotor_friction=(0.1, -0.2)), "must be left out for the short theory"),
    ],
)
def test_impossible_seals_are_refused(change, words):
    given = dict(zip(NAMES, VALUES)) | change
    with pytest.raises(jr.InputError, match=words):
        pump(jr.elements.AnnularSeal(**given))
    if "theory" not in given or given["theory"] == "short":  # nor by themselves
        alone = jr.elements.AnnularSeal(**given)
        for ask in (lambda: alone.coefficients(100.0), lambda: alone.support([0.0, 100.0])):
            with pytest.raises(jr.InputError, match="`AnnularSeal`: .*" + words):
                ask()


@pytest.mark.parametrize(
    "speeds, words",
    [
        ([], "a rising list of 2 numbers at least in rad/s, but has shape .0"),
        ([300.0], "a rising list of 2 numbers at least in rad/s, but has shape .1"),
        ([300.0, 100.0], "a rising list .* does not rise"),
        ([-100.0, 100.0], "finite and 0 at least, but holds -100"),
        ([100.0, np.nan], "finite and 0 at least, but holds nan"),
    ],
)
def test_speeds_that_no_table_has_are_refused(seal, speeds, words):
    with pytest.raises(jr.InputError, match="speeds must be " + words):
        seal.support(speeds)


def test_laminar_flow_is_refused(seal):
    thick = jr.elements.AnnularSeal(**dict(zip(NAMES, VALUES)) | dict(viscosity=0.5))
    for ask in (lambda: thick.coefficients(100.0), lambda: thick.support([0.0, 100.0])):
        with pytest.raises(jr.InputError, match="flow must be turbulent .* a JournalBearing"):
            ask()
    with pytest.raises(jr.InputError, match="speed must be finite, but is nan rad/s"):
        seal.coefficients(np.nan)
