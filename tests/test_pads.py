"""Bearings of pads: equilibria and coefficients against published tables, an independent solution of
Reynolds' equation and limits in closed form; inside machines against tables of their coefficients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.linear.linearise import models_at

DIAMETER, VISCOSITY, SPEED = 0.1, 0.02, 100 * np.pi
HALVES = (-np.pi / 2, np.pi / 2)
DEG = np.pi / 180


def bearing(slenderness=0.5, own=1e-4, load=(0.0, -3000.0), **given):
    """`own`: a pad's clearance."""
    preload = np.max(given.get("preload", 0.0))
    given = dict(pads=HALVES, arc=160 * DEG, preload=0.0, offset=0.5, speeds=(100.0, 1e3)) | given
    if len(given["pads"]) == 2:  # of one shape: one program
        given |= {
            k: np.ones(2) * given[k] for k in ("arc", "preload", "offset") if np.ndim(given[k]) == 0
        }
    return jr.elements.FixedPadBearing(
        DIAMETER, slenderness * DIAMETER, own * (1 - preload), VISCOSITY, load, **given
    )


def load_of(sommerfeld, slenderness=0.5, own=1e-4):
    turns = SPEED / (2 * np.pi)
    scale = VISCOSITY * turns * slenderness * DIAMETER**2 * (DIAMETER / (2 * own)) ** 2
    return np.array([0.0, -scale / sommerfeld])


# --- published tables

# Lund & Thomsen (1978): two axial grooves of 20 degrees; S, eps, phi, then over W/C, of x along the load and
# y across it: Kxx, Kxy, Kyx, Kyy, and over W/(C speed) Bxx, Bxy = Byx, Byy
GROOVED = {
    0.5: [
        (1.656, 0.244, 65.85, 1.69, 5.06, -2.20, 1.95, 9.93, 2.15, 4.80),
        (0.917, 0.372, 57.45, 2.12, 4.01, -1.30, 1.85, 7.70, 2.06, 3.23),
        (0.580, 0.477, 51.01, 2.67, 3.70, -0.78, 1.75, 6.96, 1.94, 2.40),
        (0.379, 0.570, 45.43, 3.33, 3.64, -0.43, 1.68, 6.76, 1.87, 1.89),
        (0.244, 0.655, 40.25, 4.21, 3.74, -0.13, 1.64, 6.87, 1.82, 1.54),
    ],
    1.0: [
        (0.991, 0.150, 70.58, 1.56, 7.29, -2.16, 1.52, 14.66, 1.58, 4.49),
        (0.635, 0.224, 63.54, 1.62, 5.33, -1.57, 1.56, 10.80, 1.70, 3.41),
        (0.235, 0.460, 49.27, 2.19, 3.57, -0.80, 1.55, 7.36, 1.89, 2.19),
        (0.159, 0.559, 44.33, 2.73, 3.36, -0.48, 1.48, 6.94, 1.78, 1.74),
        (0.108, 0.650, 39.72, 3.45, 3.34, -0.23, 1.44, 6.89, 1.72, 1.43),
    ],
}
# the same, elliptical, preload a half, L/D = 1; S, eps and coefficients by the clearance of a lobe
ELLIPTICAL = [
    (0.211, 0.260, 87.79, 6.65, 4.36, -3.21, 0.86, 13.09, -2.23, 3.70),
    (0.161, 0.304, 83.29, 5.63, 3.84, -2.32, 1.01, 10.75, -1.02, 3.07),
    (0.120, 0.350, 81.80, 4.99, 3.54, -1.52, 1.14, 9.04, -0.01, 2.49),
    (0.097, 0.381, 78.65, 4.82, 3.46, -1.01, 1.21, 8.26, 0.56, 2.10),
]


def in_their_frame(point, load, own=1e-4):
    """eps, phi (degrees), then the eight."""
    W = np.linalg.norm(load)
    K, C = np.asarray(point.stiffness) * own / W, np.asarray(point.damping) * own * SPEED / W
    eps = np.linalg.norm(point.eccentricity) / own
    phi = np.degrees(point.attitude_angle)
    eight = [K[1, 1], -K[1, 0], -K[0, 1], K[0, 0], C[1, 1], -C[1, 0], -C[0, 1], C[0, 0]]
    return np.array([eps, phi, *eight])


@pytest.mark.parametrize("slenderness", [0.5, 1.0])
def test_lund_and_thomsens_grooved_bearing(slenderness):
    """Our grid makes 0.5 % of coefficients, theirs more: where a film ends moves from row to row."""
    for S, *row in GROOVED[slenderness]:
        load = load_of(S, slenderness)
        found = in_their_frame(bearing(slenderness).working_point(SPEED, load), load)
        np.testing.assert_allclose(found[0], row[0], atol=1.2e-3)
        np.testing.assert_allclose(found[1], row[1], atol=0.15)
        np.testing.assert_allclose(np.delete(found[2:], 6), row[2:], rtol=0.035, atol=0.04)
        assert found[7] == pytest.approx(found[8], rel=3e-3)  # damping is symmetric


def test_lund_and_thomsens_elliptical_bearing():
    """phi of the second row is printed out of line with its neighbours."""
    for S, *row in ELLIPTICAL:
        load = load_of(S, 1.0)
        found = in_their_frame(bearing(1.0, preload=0.5).working_point(SPEED, load), load)
        np.testing.assert_allclose(found[0], row[0], atol=1.2e-3)
        np.testing.assert_allclose(found[1], row[1], atol=2.0)
        np.testing.assert_allclose(np.delete(found[2:], 6), row[2:], rtol=0.02, atol=0.06)


def test_someyas_leakage():
    """Databook, p. 14: two axial grooves of 10 degrees, L/D = 0.5: S, eps, phi, Q over pi D L c N."""
    for S, eps, phi, Q in (
        (4.43, 0.100, 80.4, 0.0880),
        (1.24, 0.300, 64.1, 0.243),
        (0.517, 0.500, 51.1, 0.366),
        (0.187, 0.700, 38.2, 0.459),
        (0.0926, 0.800, 31.2, 0.496),
    ):
        point = bearing(arc=170 * DEG).working_point(SPEED, load_of(S))
        assert float(point.sommerfeld) == pytest.approx(S, rel=1e-12)
        assert float(point.eccentricity_ratio) == pytest.approx(eps, abs=0.003)
        assert np.degrees(point.attitude_angle) == pytest.approx(phi, abs=1.0)
        unit = np.pi * DIAMETER * 0.5 * DIAMETER * 1e-4 * SPEED / (2 * np.pi)
        assert float(point.leakage) / unit == pytest.approx(Q, rel=0.05)


def test_raimondi_and_boyds_full_bearing():
    """ASLE Trans. 1 (1958) 159: eccentricity ratio -> S; a pad nearly all around, its edges
    where the film is thickest."""
    for slenderness, eps, S in (
        (0.25, 0.6, 1.07),
        (0.5, 0.4, 0.779),
        (0.5, 0.8, 0.0923),
        (1.0, 0.6, 0.121),
        (1.0, 0.9, 0.0188),
    ):
        load = load_of(S, slenderness)
        at = -np.pi / 2
        for _ in range(3):
            most = bearing(slenderness, pads=(at, at + np.pi), arc=(340 * DEG, 15 * DEG))
            point = most.working_point(SPEED, load)
            at = float(np.arctan2(point.eccentricity[1], point.eccentricity[0]))
        assert float(point.eccentricity_ratio) == pytest.approx(eps, rel=0.012)


def test_whirl_threshold_of_a_rigid_rotor():
    """Nicholas, Barrett & Leader, J. Mech. Des. 102 (1980) 344, table 6, set A, two axial grooves, L/D = 1:
    S, eps and the threshold over sqrt(g/c), 2.1; asymptote of Nicholas (1994): 2.05."""
    for S, eps in ((5.3, 0.03), (4.3, 0.04)):
        load = load_of(S, 1.0)
        point = bearing(1.0).working_point(SPEED, load)
        assert float(point.eccentricity_ratio) == pytest.approx(eps, abs=0.006)
        W = np.linalg.norm(load)
        k, b = np.asarray(point.stiffness) * 1e-4 / W, np.asarray(point.damping) * 1e-4 * SPEED / W
        trace = b[0, 0] + b[1, 1]
        held = (
            k[0, 0] * b[1, 1] + k[1, 1] * b[0, 0] - k[0, 1] * b[1, 0] - k[1, 0] * b[0, 1]
        ) / trace
        ratio = ((k[0, 0] - held) * (k[1, 1] - held) - k[0, 1] * k[1, 0]) / np.linalg.det(b)
        assert np.sqrt(held / ratio) == pytest.approx(2.1, rel=0.03)


# --- another solution, and limits


def on_a_grid(e, rate, spin, b, around=180, along=24):
    """Force on the journal by central differences on an even grid over each whole pad, its pressure cut off
    by its active set, sparse LU; trapezoids."""
    R, L, mu = float(b.diameter) / 2, float(b.length), float(b.viscosity)
    total = np.zeros(2)
    for middle, arc, preload, offset in zip(
        *(np.broadcast_to(x, len(b.pads)) for x in (b.pads, b.arc, b.preload, b.offset))
    ):
        own = float(b.clearance) / (1 - preload)
        lead = middle - arc / 2
        nearest = lead + offset * arc
        angle = np.linspace(lead, lead + arc, around + 1)
        step, dz = angle[1] - angle[0], L / along

        def height(a, own=own, preload=preload, nearest=nearest):
            moved = own * (1 - preload * np.cos(a - nearest))
            return moved - e[0] * np.cos(a) - e[1] * np.sin(a)

        h = height(angle[1:-1])
        after, before = height(angle[1:-1] + step / 2) ** 3, height(angle[1:-1] - step / 2) ** 3
        slope = (height(angle[2:]) - height(angle[:-2])) / (2 * step)
        rise = -rate[0] * np.cos(angle[1:-1]) - rate[1] * np.sin(angle[1:-1])
        right = np.repeat(12 * mu * (spin / 2 * slope + rise), along - 1)
        theta = sp.diags([before[1:], -(after + before), after[:-1]], [-1, 0, 1]) / (R * step) ** 2
        axial = sp.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(along - 1, along - 1)) / dz**2
        A = sp.csr_array(sp.kron(theta, sp.eye(along - 1)) + sp.kron(sp.diags([h**3], [0]), axial))
        free = right < 0
        while True:
            p = np.zeros(len(right))
            on = np.flatnonzero(free)
            p[on] = spsolve(A[on][:, on].tocsc(), right[on])
            now = np.where(free, p > 0, A @ p - right > 1e-9 * np.abs(right).max())
            if np.all(now == free):
                break
            free = now
        mean = p.reshape(-1, along - 1).sum(axis=1) * dz * step * R
        total -= np.array([mean @ np.cos(angle[1:-1]), mean @ np.sin(angle[1:-1])])
    return total


def test_an_independent_solution():
    """Pads that differ, a preload off the middle, a load aslant: the force and its slopes by place and
    velocity."""
    b = bearing(0.7, arc=(150 * DEG, 120 * DEG), preload=(0.4, 0.3), offset=(0.7, 0.6), own=1e-4)
    load = np.array([1500.0, -6000.0])
    point = b.working_point(SPEED, load)
    e, still = np.asarray(point.eccentricity), np.zeros(2)
    np.testing.assert_allclose(
        on_a_grid(e, still, SPEED, b), -load, rtol=0, atol=3e-3 * np.linalg.norm(load)
    )
    np.testing.assert_allclose(np.sum(point.forces, axis=0), -load, atol=1e-9 * 6000)
    h = 2e-6  # over several rows of either grid
    for i in range(2):
        d = h * np.eye(2)[i]
        K = -(on_a_grid(e + d, still, SPEED, b) - on_a_grid(e - d, still, SPEED, b)) / (2 * h)
        v = 0.5 * SPEED * d
        C = -(on_a_grid(e, v, SPEED, b) - on_a_grid(e, -v, SPEED, b)) / (SPEED * h)
        for found, expected in ((point.stiffness[:, i], K), (point.damping[:, i], C)):
            size = np.linalg.norm(expected)
            np.testing.assert_allclose(found, expected, rtol=0, atol=8e-3 * size)


def test_short_limit_is_ocvirks():
    """A fiftieth of the diameter long, nothing flows around: Reynolds' condition is Guembel's."""
    plain = jr.JournalBearing(DIAMETER, 0.02 * DIAMETER, 1e-4, VISCOSITY)
    b = bearing(0.02, arc=np.pi)
    for load in ((0.0, -3.0), (0.0, -0.3)):
        expected, found = plain.working_point(load, SPEED), b.working_point(SPEED, load)
        for name in ("eccentricity", "stiffness", "damping"):
            one, other = (np.asarray(getattr(x, name)) for x in (found, expected))
            np.testing.assert_allclose(one, other, rtol=0, atol=0.025 * np.linalg.norm(other))


def test_stiffness_is_what_the_load_moves():
    """And turning backward is a mirror image."""
    b = bearing(preload=0.5)
    point = b.working_point(SPEED)
    h = 0.3
    ends = [
        [b.working_point(SPEED, (s * dx, -3000.0 + s * dy)).eccentricity for s in (h, -h)]
        for dx, dy in np.eye(2)
    ]
    moved = np.stack([(np.asarray(a) - np.asarray(c)) / (2 * h) for a, c in ends], axis=1)
    np.testing.assert_allclose(point.stiffness @ moved, np.eye(2), rtol=0, atol=2e-5)
    back = b.working_point(-SPEED)
    np.testing.assert_allclose(back.eccentricity, point.eccentricity * np.array([-1, 1]), rtol=1e-7)
    assert float(back.power) == pytest.approx(float(point.power), rel=1e-9)
    # power: shear of whole films, and of what is left of broken ones, is not above Petroff's by thinnest film
    petroff = VISCOSITY * (SPEED * 0.05) ** 2 * np.pi * DIAMETER * 0.05
    assert 0.5 * petroff / 2e-4 < float(point.power) < petroff / float(point.film)


NAMES = "diameter length clearance viscosity arc preload offset thinning carried".split()
VALUES = np.array([0.1, 0.06, 1e-4, 0.03, 2.6, 0.3, 0.6, 0.03, 0.9])


def test_slopes_of_a_working_point():
    """With oil that warms, by each parameter, load and speed, along one direction: forward, reverse, central
    differences over a step in which no film's end passes a row."""

    def value(x):
        given = dict(zip(NAMES, VALUES * (1 + x[:9])))
        b = jr.elements.FixedPadBearing(
            load=(0.0, -1.0), speeds=(1.0, 2.0), around=32, along=4, **given
        )
        point = b.working_point(300.0 * (1 + x[9]), jnp.array([500.0, -4e3]) * (1 + x[10]))
        parts = [point.stiffness / 1e8, point.damping / 1e5, point.eccentricity / 1e-4]
        parts += [point.leakage / 1e-5, point.power / 1e3]
        total = sum(
            jnp.sum((1.0 + jnp.arange(p.size)) * p.ravel() * 1.3**i) for i, p in enumerate(parts)
        )
        rise = b.carried * point.power / (b.heat_capacity * point.leakage)
        return jnp.stack([total, point.viscosity / b.viscosity, jnp.exp(-b.thinning * rise)])

    direction = jnp.array([1.0, -0.7, 0.4, 0.3, -0.2, 0.5, 0.3, 0.6, -0.4, 0.8, -0.5])

    @quickly_compiled
    def every(x):
        found, forward = jax.linearize(value, x)
        (reverse,) = jax.linear_transpose(forward, x)(jnp.array([1.0, 0.0, 0.0]))
        return found, forward(direction)[0], reverse

    h = 1e-6
    found, forward, reverse = every(jnp.zeros(11))
    # the oil is as warm as what leaks must be to take the heat along
    assert 0.3 < float(found[1]) < 0.9
    assert float(found[1]) == pytest.approx(float(found[2]), rel=1e-10)
    ahead, behind = (float(every(s * h * direction)[0][0]) for s in (1, -1))
    assert float(forward) == pytest.approx((ahead - behind) / (2 * h), rel=5e-7)
    assert float(reverse @ direction) == pytest.approx(float(forward), rel=1e-9)
    assert np.all(np.abs(reverse) > 1e-3)


# --- in machines


def rotor(part, at="disc"):
    """A disc that nothing else holds, so that little is compiled."""
    disc = jr.Rotor(300.0, 3.0, 2.0, jr.Unbalance(1e-5, 0.0))
    return jr.Machine({"disc": disc, "film": part}, {"film": at})


def test_in_machines_it_is_a_table_of_its_coefficients():
    """Linear models and rates; the books close, its work being a load's; a run beyond its speeds says so."""
    b = bearing(speeds=(200.0, 400.0), preload=0.5)
    point = b.working_point(400.0)
    six = np.zeros((2, 2, 6, 6))
    six[:, 0, :2, :2], six[:, 1, :2, :2] = point.stiffness, point.damping
    alike = rotor(jr.SpeedDependentSupport([0.0, 1.0], six[:, 0], six[:, 1]))
    machine = rotor(b)
    found, expected = (models_at(m, "undeformed")(400.0) for m in (machine, alike))
    for name in ("M", "C", "K", "A"):
        a, c = np.asarray(getattr(found, name)), np.asarray(getattr(expected, name))
        np.testing.assert_allclose(a, c, rtol=0, atol=1e-10 * np.abs(c).max())
    fast = jr.State(np.full((1, 6), 1e-3), np.array([[0.0] * 5 + [300.0]]))
    audit = jr.energy_audit(machine, 0.005, 20000.0, fast, step=1e-5)
    assert float(audit.relative) < 1e-7
    at, rows, unit = b.looked_up(((jnp.zeros(6), jnp.zeros(6).at[5].set(-700.0)),))
    assert (float(at), float(rows[-1]), unit) == (700.0, 400.0, "rad/s")  # so a run says so


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(preload=1.2), "preload must be below 1"),
        (dict(offset=1.5), "offset must be 0 to 1"),
        (dict(arc=3.5), "pads must not overlap, but the one at 90 degrees reaches"),
        (dict(load=(0.0, 0.0)), "load must not be zero"),
        (dict(speeds=(200.0, 100.0)), "speeds must be two at least and increase"),
        (dict(arc=(1.0, 1.0, 1.0)), "arc must be one number or one for each of 2 pads, but has 3"),
        (dict(pads=()), "pads must have an angle for each pad"),
    ],
)
def test_impossible_bearings_are_refused(change, words):
    b = bearing(**change) if "preload" not in change else bearing(own=-1e-4, **change)
    with pytest.raises(jr.InputError, match="`film`: " + words):
        rotor(b)
    with pytest.raises(jr.InputError, match="`FixedPadBearing`: " + words):
        b.working_point(SPEED)


def test_impossible_questions_are_refused():
    b = bearing()
    for ask, words in (
        (lambda: b.working_point(0.0), "speed must be finite and not zero"),
        (lambda: b.working_point(SPEED, (0.0, np.nan)), "load must be finite and not zero"),
        (lambda: b.support([0.0, 100.0]), "speeds must be positive"),
        (lambda: b.support([200.0, 100.0]), "does not rise"),
        (lambda: bearing(around=33), "around must be even"),
        (lambda: b.working_point(0.1, (3e6, 0.0)), "no equilibrium is found at a speed of 0.1"),
    ):
        with pytest.raises(jr.InputError, match=words):
            ask()
