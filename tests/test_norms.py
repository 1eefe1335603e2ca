"""Peaks, H2 and H-infinity norms and clustered poles of a rotor with an absorber, against closed forms."""

import equinox as eqx
import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

import jaxrotor as jr
from jaxrotor.linear.cluster import decay_rate, pole_cluster
from jaxrotor.linear.norms import h2_norm, h_infinity_norm, response_peaks

J, K = 0.04, 900.0
AT = "undeformed"  # nothing loads it; the search for an equilibrium would be compiled in vain
WN = 150.0  # rad/s, of the rotor without absorber
TURN = "disc.phi"
HELD = ("x", "y", "z", "psi", "theta")

# Nishihara & Asami, J. Vib. Acoust. 124 (2002) 576, as listed in DMP-01: mu -> f, zeta, highest peak
PUBLISHED = {
    0.01: (0.99009862650316, 0.060961784027078, 14.179643369476),
    0.1: (0.90905829290854, 0.18546983623124, 4.5891655660569),
    0.2: (0.83322299137089, 0.25217344438207, 3.3254388411235),
}
MU = pytest.mark.parametrize("mu", PUBLISHED)


def machine(mu, f, zeta, held=HELD, c=0.0):
    """A rotor on a torsion spring, with a ring of `mu` times its inertia on it, tuned to f times the rotor's
    own frequency, its damping zeta times the ring's critical one; `c`: of the torsion spring."""
    own, w = mu * J, f * WN
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "spring": jr.Coupling([0.0, 0, 0, 0, 0, K], jnp.zeros(6).at[5].set(c)),
            "disc": jr.Rotor(1.0, J, 0.03),
        },
        attachments={"absorber": (jr.TorsionalDamper(own, 2 * own * w * zeta, own * w**2), "disc")},
        fixed={"disc": held},
    )


def measures(p):
    """For mu, f, zeta and a rotor of unit stiffness and frequency: where two peaks are, their magnitudes,
    the H2 norm, mean and spread of the two upper poles."""
    parts = machine(*p)
    peaks = response_peaks(parts, TURN, TURN, 0.0, 2 * WN, at=AT)
    h2 = h2_norm(parts, TURN, TURN, at=AT) * K / np.sqrt(WN)
    mean, spread = pole_cluster(jr.linearize(parts, at=AT), 1j * WN)
    poles = [mean.real / WN, mean.imag / WN, spread.real / WN**2, spread.imag / WN**2]
    return jnp.concatenate([peaks.frequencies / WN, peaks.magnitudes * K, jnp.stack([h2, *poles])])


WHERE, HEIGHTS, H2 = slice(0, 2), slice(2, 4), 4
both = jax.jit(jax.jacfwd(lambda p: (measures(p),) * 2, has_aux=True))  # compiled once for all


def evaluated(*p):
    """Measures and their derivatives by mu, f, zeta."""
    slopes, values = both(jnp.array(p, float))
    return np.asarray(values), np.asarray(slopes)


def upper_poles(x):
    """Mean and spread."""
    return x[5] + 1j * x[6], x[7] + 1j * x[8]


@jax.jit
def h_infinity(parts):
    return h_infinity_norm(parts, TURN, TURN, at=AT) * K


def polynomials(mu, f, zeta):
    """Twist by moment, K and J taken as 1: coefficients from the constant one upwards."""
    top = [f**2, 2 * zeta * f, 1.0, 0.0]
    bottom = [f**2, 2 * zeta * f, 1 + f**2 * (1 + mu), 2 * zeta * f * (1 + mu), 1.0]
    return top, bottom


def response(w, p):
    top, bottom = (np.polyval(np.array(x)[::-1], 1j * w) for x in polynomials(*p))
    return abs(top / bottom)


@MU
def test_h_infinity_optimum(mu):
    f, zeta, height = PUBLISHED[mu]
    r = np.sqrt(4 + 3 * mu)
    exact = (
        2
        / (1 + mu)
        * np.sqrt(
            2 * (16 + 23 * mu + 9 * mu**2 + 2 * (2 + mu) * r) / (64 + 80 * mu + 27 * mu**2) / 3
        ),
        np.sqrt((8 + 9 * mu - 4 * r) / (1 + mu)) / 4,
    )
    closed = np.sqrt(((8 + 9 * mu) ** 2 * (16 + 9 * mu) - 128 * r**3) / (3 * (32 + 27 * mu)))
    np.testing.assert_allclose(exact, (f, zeta), rtol=1e-13)
    p = (mu, *exact)
    values, slopes = evaluated(*p)
    where, found = values[WHERE], values[HEIGHTS]
    np.testing.assert_allclose(found, closed / (3 * mu), rtol=1e-12)
    np.testing.assert_allclose(found, height, rtol=1e-12)
    np.testing.assert_allclose(found, response(where, p), rtol=1e-12)
    assert h_infinity(machine(*p)) == pytest.approx(height, rel=1e-12)
    # no change of f and zeta lowers both peaks: their gradients point in opposite directions
    low, high = slopes[HEIGHTS, 1:]
    assert low @ high < 0
    sine = (low[0] * high[1] - low[1] * high[0]) / np.linalg.norm(low) / np.linalg.norm(high)
    assert abs(sine) < 1e-9


@MU
def test_den_hartogs_tuning_is_near_it(mu):
    p = (mu, 1 / (1 + mu), np.sqrt(3 * mu / (8 * (1 + mu))))
    found = evaluated(*p)[0][HEIGHTS]
    # above the height of the fixed points, through which every response goes, and above the optimum
    assert found.min() > np.sqrt(1 + 2 / mu)
    assert PUBLISHED[mu][2] < found.max() < 1.01 * PUBLISHED[mu][2]
    assert h_infinity(machine(*p)) == pytest.approx(found.max(), rel=1e-13)


@MU
def test_lanchesters_damper(mu):
    best = 2 * mu * J * WN / np.sqrt(2 * (1 + mu) * (2 + mu))

    def damped(c):
        return machine(mu, 1.0, 0.0).set({"absorber.stiffness": 0.0, "absorber.damping": c})

    found = response_peaks(damped(best), TURN, TURN, 0.0, 2 * WN, 1, at=AT)
    np.testing.assert_allclose(found.magnitudes * K, 1 + 2 / mu, rtol=1e-12)
    np.testing.assert_allclose(found.frequencies, WN * np.sqrt(2 / (2 + mu)), rtol=1e-9)
    # the ring's angle, which nothing brings back, is not seen: the norm is no less finite
    norm = h_infinity(damped(best))
    assert norm == pytest.approx(1 + 2 / mu, rel=1e-12)
    assert h_infinity(damped(1.01 * best)) > norm < h_infinity(damped(0.99 * best))


def test_derivatives():
    p = np.array([0.1, 0.88, 0.15])
    _, forward = evaluated(*p)
    for i, h in enumerate(1e-4 * np.diag(p)):
        near, far = (evaluated(*(p + k * h))[0] - evaluated(*(p - k * h))[0] for k in (1, 2))
        central = (8 * near - far) / (12 * h[i])
        np.testing.assert_allclose(forward[:, i], central, rtol=1e-7, atol=1e-9)

    @jax.jit
    @jax.jacrev
    def reverse(p):
        return jnp.stack(response_peaks(machine(*p), TURN, TURN, 0.0, 2 * WN, at=AT))

    scale = np.array([1 / WN, 1 / WN, K, K])[:, None]
    np.testing.assert_allclose(reverse(p).reshape(4, 3) * scale, forward[:4], rtol=1e-9, atol=1e-12)

    @jax.jit
    @jax.vmap
    @jax.value_and_grad
    def batch(p):
        return h2_norm(machine(*p), TURN, TURN, at=AT) * K / np.sqrt(WN)

    found, slopes = batch(jnp.array([p, [0.01, 0.99, 0.06]]))
    np.testing.assert_allclose(found, [h2_closed(*p), h2_closed(0.01, 0.99, 0.06)], rtol=1e-12)
    np.testing.assert_allclose(slopes[0], forward[H2], rtol=1e-9)
    model = jr.linearize(machine(*p), at=AT)

    def poles(A):
        found = pole_cluster(eqx.tree_at(lambda m: m.A, model, A), 1j * WN)
        return jnp.stack([found.mean.real, found.mean.imag, found.spread.real, found.spread.imag])

    reverse, straight = jax.jit(jax.jacrev(poles)), jax.jit(jax.jacfwd(poles))
    np.testing.assert_allclose(reverse(model.A), straight(model.A), rtol=1e-9, atol=1e-10)


def test_fewer_peaks_and_torque_out():
    parts = machine(0.1, 0.9, 2.0)  # the ring all but sticks: one peak
    found = response_peaks(parts, TURN, TURN, 0.0, 2 * WN, 3, at=AT)
    assert found.frequencies.shape == (3,) and float(jnp.ptp(found.frequencies)) == 0.0
    torque = response_peaks(parts, TURN, "spring.torque", 10.0, 2 * WN, 1, at=AT)
    np.testing.assert_allclose(torque.magnitudes, K * found.magnitudes[:1], rtol=1e-12)
    with pytest.raises(jr.InputError, match="no peak between 300 and 600 rad/s: ask for another"):
        response_peaks(parts, TURN, TURN, 300.0, 600.0, at=AT)
    with pytest.raises(jr.InputError, match="must be rising and not negative, but are 3 and 2"):
        response_peaks(parts, TURN, TURN, 3.0, 2.0)


def test_a_sharp_peak_is_not_stepped_over():
    """One coordinate: 1/(2 zeta sqrt(1 - zeta²)) at w0 sqrt(1 - 2 zeta²); and 1/sqrt(4 zeta), H2."""
    zeta = 1e-5
    parts = machine(1e-30, 1e-10, 0.0, c=2 * zeta * J * WN)  # hardly a ring
    parts = parts.set({"absorber.stiffness": 0.0})
    found = response_peaks(parts, TURN, TURN, 0.0, 7 * WN, 1, points=20, at=AT)
    np.testing.assert_allclose(
        found.magnitudes * K, 1 / (2 * zeta * np.sqrt(1 - zeta**2)), rtol=1e-9
    )
    np.testing.assert_allclose(found.frequencies, WN * np.sqrt(1 - 2 * zeta**2), rtol=1e-12)
    np.testing.assert_allclose(found.magnitudes * K, h_infinity(parts), rtol=1e-12)
    assert h2_norm(parts, TURN, TURN, at=AT) * K == pytest.approx(
        np.sqrt(WN / (4 * zeta)), rel=1e-9
    )


def test_h_infinity_norm_at_rest_and_certified():
    """The largest singular value passes gamma just where the Hamiltonian matrix has imaginary eigenvalues
    (Boyd, Balakrishnan & Kabamba, Math. Control Signals Syst. 2 (1989) 207)."""
    stiff = machine(0.2, 0.8, 0.2).set({"spring.damping": jnp.zeros(6).at[5].set(3 * J * WN)})
    for parts, rest in ((stiff, True), (machine(0.2, 0.8, 0.2), False)):
        norm = float(h_infinity(parts)) / K
        assert (norm == pytest.approx(1 / K, rel=1e-12)) == rest
        model = jr.linearize(parts, at=AT)
        A, b = np.asarray(model.A), np.asarray(model.B[:, 0])
        c = np.eye(4)[0]
        for gamma, crosses in ((norm * (1 - 1e-6), True), (norm * (1 + 1e-6), False)):
            H = np.block([[A, np.outer(b, b) / gamma], [-np.outer(c, c) / gamma, -A.T]])
            real = np.abs(np.linalg.eigvals(H).real).min()
            assert (real < 1e-9 * WN) == crosses


def h2_closed(mu, f, zeta):
    """Crandall & Mark, Random Vibration (1963): the integral of |G|² for a system of fourth order."""
    (b0, b1, b2, b3), (a0, a1, a2, a3, a4) = polynomials(mu, f, zeta)
    top = a0 * b3**2 * (a0 * a3 - a1 * a2) + a0 * a1 * a4 * (2 * b1 * b3 - b2**2)
    top += -a0 * a3 * a4 * (b1**2 - 2 * b0 * b2) + a4 * b0**2 * (a1 * a4 - a2 * a3)
    integral = np.pi * top / (a0 * a4 * (a0 * a3**2 + a1**2 * a4 - a1 * a2 * a3))
    return np.sqrt(integral / (2 * np.pi))


@MU
def test_h2_norm(mu):
    f = np.sqrt((2 + mu) / 2) / (1 + mu)
    zeta = np.sqrt(mu * (4 + 3 * mu) / (8 * (1 + mu) * (2 + mu)))
    for p in ((mu, 0.9 * f, 0.5 * zeta), (mu, f, zeta)):
        values, slopes = evaluated(*p)
        assert values[H2] == pytest.approx(h2_closed(*p), rel=1e-12)
    area = sum(
        quad(lambda w: response(w, p) ** 2, *ends, epsabs=0, epsrel=1e-11, limit=200)[0]
        for ends in ((0, 0.9), (0.9, 1.1), (1.1, 2), (2, np.inf))
    )
    assert values[H2] == pytest.approx(np.sqrt(area / np.pi), rel=1e-10)
    # Asami et al., J. Vib. Acoust. 124 (2002) 284: no better f and zeta
    assert np.abs(slopes[H2, 1:] * [f, zeta]).max() < 1e-10 * values[H2]


def test_torsion_alone_and_refusals():
    p = (0.1, 0.9, 0.2)
    want = h2_closed(*p) * np.sqrt(WN) / K
    free = machine(*p, held=())
    for torsion in (False, True):  # free and undamped sideways, which twisting does not meet
        assert h2_norm(free, TURN, TURN, at=AT, torsion=torsion) == pytest.approx(want, rel=1e-12)
    endless = machine(0.1, 0.9, 0.0)
    with pytest.raises(jr.InputError, match="`disc.phi` by `disc.phi`: the H2 norm is infinite"):
        h2_norm(endless, TURN, TURN, at=AT)
    with pytest.raises(jr.InputError, match="the H-infinity norm is infinite.*damp it"):
        h_infinity_norm(endless, TURN, TURN, at=AT)
    assert h_infinity(endless) == np.inf
    with pytest.raises(jr.InputError, match="`disc.x`: with torsion=True only moments along phi"):
        h2_norm(free, "disc.x", TURN, torsion=True)


def exact_cluster(p):
    """Mean and spread of the two upper roots of the characteristic polynomial, with 50 digits."""
    with mpmath.workdps(50):
        mu, f, zeta = map(mpmath.mpf, p)
        coefficients = polynomials(mu, f, zeta)[1]
        roots = mpmath.polyroots(coefficients, asc=True, maxsteps=500, extraprec=400)
        a, b = [r for r in roots if r.imag > 0]
        return (a + b) / 2, ((a - b) / 2) ** 2


def exact_slopes(p):
    """Of both by mu, f, zeta, by differences too small for double precision."""
    with mpmath.workdps(50):
        h, columns = mpmath.mpf(10) ** -15, []
        for i in range(3):
            up, down = (
                [mpmath.mpf(x) + s * h * (i == j) for j, x in enumerate(p)] for s in (1, -1)
            )
            pairs = zip(exact_cluster(up), exact_cluster(down))
            columns.append([complex((a - b) / (2 * h)) for a, b in pairs])
    return np.array(columns).T


@MU
def test_cluster_at_greatest_stability(mu):
    """Nishihara & Matsuhisa (1997): both pairs of poles coincide, and are defective."""
    p = (mu, 1 / (1 + mu), np.sqrt(mu / (1 + mu)))
    values, slopes = evaluated(*p)
    mean, spread = upper_poles(values)
    # the characteristic polynomial is a square, (s² + a s + f)²
    assert mean == pytest.approx(
        np.sqrt(p[1]) * np.exp(1j * np.arccos(-np.sqrt(mu) / 2)), rel=1e-12
    )
    assert abs(spread) < 1e-14
    want = exact_slopes(p)
    np.testing.assert_allclose(upper_poles(slopes), want, rtol=1e-9, atol=1e-11)


def test_cluster_elsewhere():
    p = (0.1, 0.88, 0.15)
    for got, want in zip(upper_poles(evaluated(*p)[0]), exact_cluster(p)):
        assert got == pytest.approx(complex(want), rel=1e-11)
    np.testing.assert_allclose(upper_poles(evaluated(*p)[1]), exact_slopes(p), rtol=1e-9)
    model = jr.linearize(machine(*p), at=AT)
    real = np.linalg.eigvals(np.asarray(model.A)).real
    assert decay_rate(model) == pytest.approx(-real.max(), rel=1e-12)
    whole = pole_cluster(model, 0.0, 4)  # all: the trace
    assert complex(whole.mean) == pytest.approx(np.trace(model.A) / 4, rel=1e-10)
    with pytest.raises(jr.InputError, match="the 3 eigenvalues nearest to .* are no cluster apart"):
        pole_cluster(model, 1j * WN, 3)
    with pytest.raises(jr.InputError, match="count must be from 1 to 4, all eigenvalues, but is 5"):
        pole_cluster(model, 1j * WN, 5)
