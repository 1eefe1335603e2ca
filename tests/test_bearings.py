"""Oil films and rolling bearings against integrals, published figures and closed forms."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.sparse import diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve

import jaxrotor as jr
from jaxrotor.commands.save_study import save_study
from jaxrotor.elements.bearings.film import finite_film, short_film

# Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), example 5.5.1
BEARING = jr.JournalBearing(diameter=0.1, length=0.03, clearance=1e-4, viscosity=0.1)
WEIGHT = 525.0


def rigid_rotor(speed, bearing=BEARING, eccentricity=2e-6):
    """A rotor that moves in x and y alone, on one bearing that carries its whole weight."""
    return jr.Machine.in_line(
        {"journal": jr.Rotor(WEIGHT / 9.81, 0.1, 0.05, unbalance=jr.Unbalance(eccentricity))},
        attachments={"film": (bearing, "journal")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"journal": ("z", "psi", "theta")},
        prescribed={"journal": {"phi": jr.ConstantSpeed(speed)}},
    )


def motion(e=(0.0, 0.0), e_t=(0.0, 0.0), spin=0.0, angle=0.0):
    return (
        jnp.array([*e, 0, 0, 0, angle], float),
        jnp.array([*e_t, 0, 0, 0, spin], float),
    )


@pytest.mark.parametrize("cavitated", [True, False])
def test_film_is_the_integral_of_its_pressure(cavitated):
    rng = np.random.default_rng(0)
    film = jax.jit(short_film, static_argnums=2)
    for size in (1e-4, 0.1, 0.4, 0.7, 0.9, 0.97):
        at, w = rng.uniform(0, 7), rng.normal(size=2)
        eps = size * np.array([np.cos(at), np.sin(at)])
        centre, span = np.arctan2(w[1], w[0]), np.pi / (2 if cavitated else 1)

        def flow(t, eps=eps, w=w):
            n = np.array([np.cos(t), np.sin(t)])
            return (w @ n) / (1 - eps @ n) ** 3

        expected = [
            -quad(
                lambda t, f=f: flow(t) * f(t), centre - span, centre + span, epsrel=1e-13, limit=500
            )[0]
            for f in (np.cos, np.sin)
        ]
        found = film(jnp.asarray(eps), jnp.asarray(w), cavitated)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.max(np.abs(expected)))


def test_film_is_smooth_in_the_middle():
    w = jnp.array([0.3, 0.2])
    slope = jax.jacfwd(lambda e: short_film(e, w, True))
    middle, beside = slope(jnp.zeros(2)), slope(jnp.array([1e-5, -2e-5]))
    np.testing.assert_allclose(middle, beside, rtol=3e-4)


def test_published_short_bearing():
    """BRG-01. Axes there: u across the load, v along it. The attitude angle that ROSS prints (0.199 rad) is
    its arctangent of pi sqrt(1 - e²)/4 times e instead of over it; Ocvirk's is 70.62 degrees."""
    for rpm, ratio, attitude in (
        (1500, 0.266298, 70.6200477913321),
        (2000, 0.212571, 74.51812993727886),
    ):
        point = BEARING.working_point((0.0, -WEIGHT), rpm * 2 * np.pi / 60)
        e = np.asarray(point.eccentricity)
        eps = np.linalg.norm(e) / 1e-4
        assert eps == pytest.approx(ratio, rel=3e-6)  # printed to six digits
        angle = np.arctan2(e[0], -e[1])
        assert np.degrees(angle) == pytest.approx(attitude, rel=1e-9)
        assert np.tan(angle) == pytest.approx(np.pi * np.sqrt(1 - eps**2) / (4 * eps), rel=1e-12)
    point = BEARING.working_point((0.0, -WEIGHT), 1500 * 2 * np.pi / 60)
    stiffness = [[12.80796, 16.393593], [-25.060393, 8.815303]]
    damping = [[232.89693, -81.924371], [-81.924371, 294.911619]]
    np.testing.assert_allclose(point.stiffness / 1e6, stiffness, rtol=1e-7)
    np.testing.assert_allclose(point.damping / 1e3, damping, rtol=1e-7)


def reynolds(eps, w, slenderness, around=240, along=41):
    """The film's force over mu R L³/c³ by differences in both directions at once, pressure cut off at
    ambient."""
    angle = 2 * np.pi * np.arange(around) / around
    z = np.linspace(-1, 1, along)  # over half the length
    d, dz = angle[1], z[1] - z[0]
    cube, half = ((1 - eps @ np.array([np.cos(a), np.sin(a)])) ** 3 for a in (angle, angle + d / 2))
    ring = diags_array(
        [-(half + np.roll(half, 1)), half[:-1], half[:-1], half[-1:], half[-1:]],
        offsets=[0, 1, -1, around - 1, 1 - around],
    )
    inner = along - 2
    line = diags_array(
        [-2 * np.ones(inner), np.ones(inner - 1), np.ones(inner - 1)], offsets=[0, 1, -1]
    )
    matrix = kron(ring / d**2, eye_array(inner)) + kron(
        diags_array(cube), line / dz**2 / slenderness**2
    )
    push = w @ np.array([np.cos(angle), np.sin(angle)])
    pressure = spsolve(matrix.tocsc(), -np.repeat(push, inner)).reshape(around, inner)
    mean = np.maximum(pressure, 0).sum(1) * dz / 2
    return -3 / slenderness**2 * d * np.array([mean @ np.cos(angle), mean @ np.sin(angle)])


def test_finite_film_against_reynolds_equation():
    """An independent solution in two dimensions; and as smooth in the middle as the short film."""
    film = jax.jit(finite_film)
    rng = np.random.default_rng(4)
    for slenderness in (0.2, 0.5, 1.0):
        for size in (0.1, 0.5, 0.8):
            at, w = rng.uniform(0, 7), rng.normal(size=2)
            eps = size * np.array([np.cos(at), np.sin(at)])
            found = np.asarray(film(jnp.asarray(eps), jnp.asarray(w), slenderness))
            exact = reynolds(eps, w, slenderness)
            assert np.linalg.norm(found - exact) < 0.03 * np.linalg.norm(exact)
    w = jnp.array([0.3, 0.2])
    slope = jax.jacfwd(lambda e: finite_film(e, w, 1.0))
    for beside in ((1e-6, 0.0), (0.0, -1e-6), (-1e-6, 1e-6)):
        np.testing.assert_allclose(slope(jnp.zeros(2)), slope(jnp.array(beside)), rtol=1e-3)


def test_finite_bearing_against_raimondi_and_boyd():
    """ASLE Trans. 1 (1958) 159, as in Shigley: Sommerfeld numbers (R/c)² mu N/P of journals at rest. Their
    film ends where pressure and slope vanish and bears more than one cut off: 0 to 20 % here."""
    published = {
        0.25: {0.1: 16.2, 0.2: 7.57, 0.4: 2.83, 0.6: 1.07, 0.8: 0.261},
        0.5: {0.1: 4.31, 0.2: 2.03, 0.4: 0.779, 0.6: 0.319, 0.8: 0.0923},
        1.0: {0.1: 1.33, 0.2: 0.631, 0.4: 0.264, 0.6: 0.121, 0.8: 0.0446},
    }
    for slenderness, row in published.items():
        for eps, expected in row.items():
            bearing = jr.JournalBearing(0.1, 0.1 * slenderness, 1e-4, 0.1, theory="finite")
            f = bearing.force(jnp.array([eps * 1e-4, 0.0]), jnp.array([0.0, -50.0 * eps * 1e-4]))
            pressure = np.hypot(*np.asarray(f)) / (0.1 * 0.1 * slenderness)
            number = (0.05 / 1e-4) ** 2 * 0.1 * (100 / (2 * np.pi)) / pressure
            assert 1.0 < number / expected < 1.2, (slenderness, eps)


def threshold():
    """Speed at which a rigid rotor on the film loses stability, from Routh's and Hurwitz' conditions on the
    eight coefficients: m = k/nu² (Szeri, Fluid Film Lubrication, 2nd ed., sec. 4.3)."""

    def excess(speed):
        point = BEARING.working_point((0.0, -WEIGHT), speed)
        K, C = np.asarray(point.stiffness), np.asarray(point.damping)
        crossed = K[0, 0] * C[1, 1] + K[1, 1] * C[0, 0] - K[0, 1] * C[1, 0] - K[1, 0] * C[0, 1]
        k = crossed / np.trace(C)
        ratio = ((k - K[0, 0]) * (k - K[1, 1]) - K[0, 1] * K[1, 0]) / np.linalg.det(C)
        return k / ratio - WEIGHT / 9.81, np.sqrt(ratio)

    speed = brentq(lambda w: excess(w)[0], 300.0, 2000.0, xtol=1e-10)
    return speed, excess(speed)[1]


def test_threshold_and_half_speed_whirl():
    """The linear threshold is the closed form's; runs on either side die away and grow, at about half
    speed."""
    speed, whirl = threshold()
    found = jr.stability_threshold(rigid_rotor(300.0), 300.0, 1500.0, 25, at="equilibrium")
    assert float(found) == pytest.approx(speed, rel=1e-9)
    sizes = []
    for ratio in (0.995, 1.005):
        machine = rigid_rotor(ratio * speed, eccentricity=0.0)
        state = jr.linearize(machine, ratio * speed, "equilibrium").state
        middle = np.asarray(state.position[0, :2])
        state = eqx.tree_at(lambda s: s.position, state, state.position.at[0, 0].add(1e-8))
        run = jr.simulate(machine, 1.0, 2000.0, state, rtol=1e-10, atol=1e-16, progress=False)
        away = np.asarray(run["journal"].position[:, :2]) - middle
        size = np.hypot(*away.T)
        sizes.append((size[200:400].max(), size[-200:].max()))
        if ratio > 1:
            turned = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
            rate = (turned[-1] - turned[200]) / (run.t[-1] - run.t[200])
            assert rate == pytest.approx(whirl, rel=5e-3)
            assert 0.5 < rate / speed < 0.51
    assert sizes[0][1] < 0.9 * sizes[0][0] and sizes[1][1] > 1.1 * sizes[1][0]


@pytest.mark.parametrize("theory", ["short", "finite"])
def test_machines_find_their_working_point_from_light_to_heavy(theory):
    """Eccentricity ratios from 0.0002 to 0.98: the machine's Newton method against the bearing's own."""
    film = jr.JournalBearing(0.1, 0.05, 1e-4, 0.1, theory=theory)
    machine = rigid_rotor(100.0, film)
    ratios = []
    for mass in (0.5, 50.0, 5000.0):
        heavy = machine.set({"journal.mass": mass})
        for speed in (1.0, 100.0, 5000.0):
            place = jr.linearize(heavy, speed).state.position[0, :2]
            expected = film.working_point((0.0, -9.81 * mass), speed).eccentricity
            np.testing.assert_allclose(place, expected, rtol=0, atol=1e-12)
            ratios.append(float(jnp.hypot(*expected)) / 1e-4)
    assert min(ratios) < 1e-3 and max(ratios) > 0.95


def test_derivatives_of_the_coefficients():
    def cross(viscosity):
        bearing = jr.JournalBearing(0.1, 0.03, 1e-4, viscosity)
        return bearing.working_point((0.0, -WEIGHT), 150.0).stiffness[0, 1]

    exact = jax.grad(cross)(0.1)
    h = 1e-6
    assert float(exact) == pytest.approx(float(cross(0.1 + h) - cross(0.1 - h)) / (2 * h), rel=1e-7)


@pytest.mark.parametrize("film", ["cavitated", "full"])
def test_power_of_the_film_is_lost(film):
    """What the journal and its housing lose, the film turns into heat (by quadrature over its pressure)."""
    bearing = jr.JournalBearing(0.1, 0.03, 1e-4, 0.1, film=film)
    rng = np.random.default_rng(1)
    for _ in range(5):
        e = rng.uniform(-6e-5, 6e-5, 2)
        ends = (
            motion(e, rng.normal(size=2) * 1e-3, 100 * rng.normal()),
            motion((0, 0), rng.normal(size=2) * 1e-3, 100 * rng.normal()),
        )
        on = bearing.forces(0.0, ends, None)
        power = sum(f @ v for f, (_, v) in zip(on, ends))
        assert float(bearing.power_lost(0.0, ends, None)) == pytest.approx(-float(power), rel=1e-10)
        # forces and moments about the housing's centre balance
        moment = on[0][5] + on[1][5] + e[0] * on[0][1] - e[1] * on[0][0]
        np.testing.assert_allclose(on[0][:2], -on[1][:2])
        assert abs(moment) < 1e-12 * abs(on[0][5])


def test_energy_of_a_run_on_a_film():
    machine = jr.Machine.in_line(
        {"journal": jr.Rotor(WEIGHT / 9.81, 0.001, 0.05, unbalance=jr.Unbalance(2e-6))},
        attachments={"film": (BEARING, "journal")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"journal": ("z", "psi", "theta")},
    )
    state = jr.linearize(rigid_rotor(700.0), 700.0).state
    audit = jr.energy_audit(machine, 0.02, 2000.0, state)
    assert audit.relative < 1e-8
    assert audit.kinetic[-1] < 0.8 * audit.kinetic[0]  # the film brakes it


def test_squeeze_film_in_circular_orbits():
    """Centred circles of radius eps c at the speed w, half a film under pressure: Gunter, Barrett &
    Allaire, J. Lubr. Technol. 99 (1977) 57. Radial and tangential force over mu R L³ w/c²: -2 eps²/(1 -
    eps²)² and -pi eps/(2 (1 - eps²)^(3/2))."""
    R, L, c, mu, w = 0.05, 0.02, 1e-4, 0.01, 300.0
    damper = jr.SqueezeFilmDamper(2 * R, L, c, mu)
    for eps in (0.1, 0.5, 0.9):
        ends = (motion((eps * c, 0.0), (0.0, eps * c * w), 1234.0),)
        (f,) = damper.forces(0.0, ends, None)
        unit = mu * R * L**3 * w / c**2
        assert f[0] / unit == pytest.approx(-2 * eps**2 / (1 - eps**2) ** 2, rel=1e-12)
        assert f[1] / unit == pytest.approx(-np.pi * eps / (2 * (1 - eps**2) ** 1.5), rel=1e-12)
        assert f[5] == 0  # the ring does not turn: its spin does not matter
        power = damper.power_lost(0.0, ends, None)
        assert float(power) == pytest.approx(float(-f[1] * eps * c * w), rel=1e-9)


ROLLING = dict(
    stiffness=1e10, ball_diameter=8e-3, pitch_diameter=40e-3, clearance=5e-6, damping=200.0
)


def squeezed(bearing, e, inner, room=lambda j, at: 0.0):
    """Force on the journal, one ball at a time, in plain NumPy."""
    s = 8 / 40
    total = np.zeros(2)
    for j in range(bearing.balls):
        at = 0.5 * (1 - s) * inner + 2 * np.pi * j / bearing.balls
        n = np.array([np.cos(at), np.sin(at)])
        d = e @ n - 5e-6 - room(j, at)
        total -= 1e10 * max(d, 0.0) ** 1.5 * n
    return total


def test_rolling_bearing_ball_by_ball():
    bearing = jr.RollingBearing(**ROLLING, balls=9)
    rng = np.random.default_rng(2)
    for _ in range(4):
        e, inner = rng.normal(size=2) * 2e-5, rng.uniform(0, 50)
        ends = (motion(e, (0.01, -0.02), 90.0, inner),)
        (f,) = bearing.forces(0.0, ends, None)
        expected = squeezed(bearing, e, inner)
        np.testing.assert_allclose(
            f[:2],
            expected - 200.0 * np.array([0.01, -0.02]),
            rtol=0,
            atol=1e-9 * np.max(abs(expected)),
        )
        h = 1e-6  # the spin feels the balls climb
        energies = [bearing.energy(0.0, (motion(e, angle=inner + s),), None) for s in (h, -h)]
        assert float(f[5]) == pytest.approx(
            -float(energies[0] - energies[1]) / (2 * h), rel=1e-5, abs=1e-9
        )


def test_defects_pass_at_their_frequencies():
    """A pit in a race is met as often as Harris says; each only where it stands."""
    turns, per_turn = 40, 720
    inner = 2 * np.pi * np.arange(turns * per_turn) / per_turn
    kinds = {
        "outer": jr.elements.OuterRaceDefect(-np.pi / 2, 0.1, 5e-6),
        "inner": jr.elements.InnerRaceDefect(0.0, 0.1, 5e-6),
        "ball": jr.elements.BallDefect(0.0, 0.1, 5e-6),
    }
    for name, defect in kinds.items():
        bearing = jr.RollingBearing(**ROLLING, balls=9, defects=(defect,))
        sound = jr.RollingBearing(**ROLLING, balls=9)
        frequency = float(bearing.frequencies()[name])

        def loss(bearing, angle):
            # pressed alike everywhere: what is missing is the defect's alone
            _, n = bearing._squeeze(jnp.zeros(2), angle, 0.0)
            squeeze, _ = bearing._squeeze(jnp.zeros(2), angle, 0.0)
            return jnp.sum(squeeze)

        lost = np.asarray(
            jax.vmap(lambda a, b=bearing, s=sound: loss(s, a) - loss(b, a))(jnp.asarray(inner))
        )
        entered = np.sum((lost[1:] > 1e-9) & (lost[:-1] <= 1e-9))
        passes = frequency * (2 if name == "ball" else 1)  # a ball's flat meets both races
        assert entered == pytest.approx(turns * passes, abs=1.5), name
    found = bearing.frequencies()
    assert float(found["outer"] + found["inner"]) == pytest.approx(9)
    assert float(found["outer"]) == pytest.approx(9 * float(found["cage"]))


def test_rolling_bearing_carries_what_stribeck_says():
    """Without clearance the ball in the load's line carries 4.37 W/Z for any number of balls (Stribeck
    1907)."""
    bearing = jr.RollingBearing(1e10, 8e-3, 40e-3, balls=20)
    (f,) = bearing.forces(0.0, (motion((1e-5, 0.0)),), None)
    loads = bearing.ball_loads(0.0, (motion((1e-5, 0.0)),), None)
    assert float(jnp.max(loads) * 20 / -f[0]) == pytest.approx(4.37, abs=0.01)
    assert replace(bearing, clearance=2e-5).forces(0.0, (motion((1e-5, 0.0)),), None)[0][0] == 0


def test_energy_of_a_run_on_rolling_bearings():
    defects = (jr.elements.OuterRaceDefect(-np.pi / 2, 0.3, 2e-6),)
    machine = jr.Machine.in_line(
        {"journal": jr.Rotor(2.0, 1e-4, 1e-3, unbalance=jr.Unbalance(1e-5))},
        attachments={
            "bearing": (jr.RollingBearing(**ROLLING, balls=9, defects=defects), "journal")
        },
        gravity=(0.0, -9.81, 0.0),
        fixed={"journal": ("z", "psi", "theta")},
    )
    state = jr.State(jnp.zeros((1, 6)), jnp.zeros((1, 6)).at[0, 5].set(100.0))
    audit = jr.energy_audit(machine, 0.05, 4000.0, state, rtol=1e-11)
    assert audit.relative < 1e-8
    assert audit.lost[-1] > 1e-4


def test_radial_bearing_by_a_table():
    table = jr.elements.TabulatedLaw([0.0, 1e-5, 3e-5], [0.0, 100.0, 900.0], 50.0)
    bearing = jr.RadialBearing(table)
    e, e_t = np.array([1.2e-5, -1.6e-5]), np.array([0.01, 0.03])
    (f,) = bearing.forces(0.0, (motion(e, e_t),), None)
    expected = -table.force(0.0, 2e-5, 0.0, jnp.zeros(0)) * e / 2e-5 - 50.0 * e_t
    np.testing.assert_allclose(f[:2], expected, rtol=1e-12)
    with pytest.raises(jr.InputError, match="law must be without a memory"):
        rigid_rotor(1.0, jr.RadialBearing(jr.elements.Maxwell(1.0, 1.0)))


@pytest.mark.parametrize(
    "bearing",
    [
        jr.RadialBearing(jr.elements.KelvinVoigt(1e6, 30.0)),
        jr.RadialBearing(jr.elements.TabulatedLaw([0.0, 1e-5, 3e-5], [0.0, 10.0, 30.0], 30.0)),
        jr.Rub(0.0, 1e6, 0.0),
    ],
)
def test_a_bearing_without_clearance_holds_its_centre(bearing):
    """The same law in every direction is, where it is linear, the isotropic support: at the centre, off it,
    and through it; in its derivative, too. And a linear model of the machine sees it."""
    c = 0.0 if isinstance(bearing, jr.Rub) else 30.0

    def force(x):
        return bearing.forces(0.0, (motion(x[:2], x[2:]),), None)[0][:2]

    support = -np.kron([1e6, c], np.eye(2))
    slopes = [jax.jit(way(force)) for way in (jax.jacfwd, jax.jacrev)]
    for x in (np.zeros(4), np.array([3e-6, -4e-6, 0.2, 0.1])):
        np.testing.assert_allclose(force(x), support @ x, rtol=1e-12)
        for slope in slopes:
            np.testing.assert_allclose(slope(x), support, rtol=1e-9, atol=1e-9 * 1e6)
    disc = jr.Rotor(2.0, 0.02, 0.01, unbalance=jr.Unbalance(1e-5))
    machine = jr.Machine(
        {"disc": disc, "bearing": bearing},
        {"bearing": "disc"},
        fixed={"disc": ("z", "psi", "theta")},
    )
    model = jr.linearize(machine, 300.0)
    lateral = np.sort(np.abs(np.linalg.eigvals(model.A).imag))[-4:]
    np.testing.assert_allclose(lateral, np.sqrt(5e5), rtol=1e-3)
    amplitude = np.abs(jr.unbalance_response(machine, ("disc.x", "disc.y"), 300.0).values[0])
    exact = 2e-5 * 9e4 / abs(1e6 - 2 * 9e4 + 1j * c * 300)
    np.testing.assert_allclose(amplitude, exact, rtol=1e-9)


@pytest.mark.parametrize(
    "bearing, words",
    [
        (jr.JournalBearing(0.1, 0.03, 0.02, 0.1), "clearance must be far smaller"),
        (jr.JournalBearing(0.1, -0.03, 1e-4, 0.1), "length must be positive"),
        (
            lambda: jr.JournalBearing(0.1, 0.03, 1e-4, 0.1, film="half"),
            "film must be 'cavitated' or 'full', but is 'half'",
        ),
        (jr.JournalBearing(0.1, 0.2, 1e-4, 0.1, theory="finite"), "0.1 to 1.25 diameters"),
        (jr.JournalBearing(0.1, 0.1, 1e-4, 0.1, "full", "finite"), 'film must be "cavitated"'),
        (
            lambda: jr.RollingBearing(1e10, 8e-3, 40e-3, balls=2),
            "balls must be a whole number from 3 to .*, but is 2",
        ),
        (jr.RollingBearing(1e10, 50e-3, 40e-3), "ball_diameter must be smaller"),
        (
            lambda: jr.RollingBearing(1e10, 8e-3, 40e-3, exponent=0.5),
            "exponent must be above 1",
        ),
    ],
)
def test_bad_bearings_are_refused(bearing, words):
    with pytest.raises(jr.InputError, match=words):
        rigid_rotor(100.0, bearing() if callable(bearing) else bearing)


def test_bad_working_points_are_refused():
    with pytest.raises(jr.InputError, match="load must be finite and not zero"):
        BEARING.working_point((0.0, 0.0), 100.0)
    with pytest.raises(jr.InputError, match="speed must be finite and not zero"):
        BEARING.working_point((0.0, -1.0), 0.0)


def test_a_study_with_all_of_them(tmp_path):
    """Nested defects and laws from a file; what is saved of it reads the same."""
    path = tmp_path / "bearings.toml"
    path.write_text(STUDY)
    study = jr.load(path)
    values = study.machine.parameters()
    assert float(values["bearing.defects.0.angle"]) == pytest.approx(-np.pi / 2)
    assert float(values["stop.y.other_stiffness"]) == 1e5
    assert float(values["joint.angle"]) == pytest.approx(np.deg2rad(10))
    changed = study.machine.set({"bearing.defects.0.depth": 3e-6, "rub.gap": 2e-3})
    paths = ["bearing.defects.0.depth", "rub.gap"]
    save_study(study, changed, paths, tmp_path / "again.toml")
    values = changed.parameters()
    again = jr.load(tmp_path / "again.toml").machine.parameters()
    assert set(again) == set(values)
    for name, value in values.items():
        np.testing.assert_allclose(again[name], value, rtol=1e-14, err_msg=name)


def test_forces_are_differentiable_by_every_parameter():
    """Reverse mode against central differences, at a motion where every ball, pit and face has its say."""
    pit = jr.elements.OuterRaceDefect(0.6, 0.5, 4e-6)
    flat = jr.elements.BallDefect(0.4, 0.9, 3e-6)
    parts = {
        "film": (BEARING, 2),
        "finite": (jr.JournalBearing(0.1, 0.06, 1e-4, 0.1, theory="finite"), 2),
        "squeeze": (jr.SqueezeFilmDamper(0.1, 0.03, 1e-4, 0.01), 2),
        "rolling": (jr.RollingBearing(**ROLLING, balls=9, defects=(pit, flat)), 2),
        "rub": (jr.Rub(2e-5, 1e6, 0.05, 0.2, 0.5, smoothing=1e-6), 2),
        "joint": (jr.UniversalJoint(1e3, 1.0, 0.4, 0.2), 2),
        "pedestal": (jr.LawSupport(y=jr.elements.Bilinear(1e4, 1e5, 5.0, 8.0, smoothing=4e-5)), 1),
    }
    ends = (
        motion((3e-5, -2e-5), (2e-3, 1e-3), 90.0, 0.35),
        motion((-1e-5, 5e-6), (-1e-3, 2e-3), 10.0, 0.1),
    )
    for name, (part, count) in parts.items():
        leaves, structure = jax.tree.flatten(part)

        @jax.jit
        def scalar(leaves, structure=structure, count=count):
            forces = jax.tree.unflatten(structure, leaves).forces(0.0, ends[:count], None)
            return sum(jnp.sin(jnp.arange(6.0) + i) @ f for i, f in enumerate(forces))

        exact = jax.grad(scalar)(leaves)
        for k, leaf in enumerate(leaves):
            magnitude = float(jnp.max(jnp.abs(leaf)))
            h = 1e-6 * max(magnitude, 1e-6)
            sides = [scalar([*leaves[:k], leaf + d, *leaves[k + 1 :]]) for d in (h, -h)]
            central = float(sides[0] - sides[1]) / (2 * h)
            size = abs(float(scalar(leaves))) / max(magnitude, 1e-3)
            assert float(jnp.sum(exact[k])) == pytest.approx(central, rel=1e-6, abs=1e-6 * size), (
                name,
                k,
            )


STUDY = """
title = "x"
[machine]
gravity = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]
fixed = { disc = ["z", "psi", "theta"] }
[[machine.line]]
name = "drive"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "300 rad/s" }
[[machine.line]]
name = "joint"
kind = "UniversalJoint"
stiffness = "5e3 N*m/rad"
damping = "2 N*m*s/rad"
angle = "10 deg"
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.01 kg*m^2"
transverse_inertia = "0.006 kg*m^2"
[[machine.attachments]]
name = "bearing"
kind = "RollingBearing"
at = "disc"
stiffness = 1e10
ball_diameter = "8 mm"
pitch_diameter = "40 mm"
clearance = "5 um"
damping = "600 N*s/m"
balls = 9
defects = [{ kind = "OuterRaceDefect", angle = "-90 deg", width = "7 deg", depth = "6 um" }]
[[machine.attachments]]
name = "stop"
kind = "LawSupport"
at = "disc"
y = { kind = "Bilinear", stiffness = "1e4 N/m", other_stiffness = "1e5 N/m" }
[[machine.attachments]]
name = "table"
kind = "RadialBearing"
at = "disc"
[machine.attachments.law]
kind = "TabulatedLaw"
displacements = { unit = "um", values = [0, 10, 30] }
forces = { unit = "N", values = [0, 100, 900] }
[[machine.attachments]]
name = "rub"
kind = "Rub"
at = "disc"
gap = "1 mm"
stiffness = "1e6 N/m"
radius = "50 mm"
hysteresis = "0.2 s/m"
[simulation]
t_end = "0.05 s"
sample_rate = "2 kHz"
initial = "undeformed"
"""
