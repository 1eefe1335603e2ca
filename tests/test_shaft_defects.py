"""Defects of shaft sections: against hand-written statics, the closed forms of rotordynamics, and SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree, pull
from scipy.integrate import dblquad, quad, solve_ivp
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.elements.shafts.crack_compliance import crack_compliance
from jaxrotor.simulation.solver import is_smooth

E, G = 2.1e11, 8.1e10  # jr.STEEL
NU = E / (2 * G) - 1
L, R = 0.3, 0.006
EI = E * np.pi / 4 * R**4
MASS, K = 2.0, 12 * EI / L**3  # of the disc that a guided section carries
CRITICAL = np.sqrt(K / MASS)


def jeffcott(
    speed,
    bend=0.0,
    ratio=0.0,
    depth=0.0,
    flaw=None,
    damping=0.0,
    eccentricity=0.0,
    gravity=0.0,
    twists=False,
):
    """A disc that keeps upright at the end of a clamped section, turning exactly at `speed`: two coordinates,
    stiffness K. All flaws are there, some of no size, so that one program serves every test."""
    if flaw is None:
        flaw = (
            jr.elements.Kink(bend, 0.8, 0.5),
            jr.elements.Asymmetry(ratio, 0.3),
            jr.elements.Crack(depth, 0.1, 0.4),
        )
    return jr.Machine.in_line(
        {
            "drive": jr.PrescribedSpin(jr.ConstantSpeed(speed)),
            "shaft": jr.Shaft(L, 2 * R, flaw=flaw),
            "disc": jr.Rotor(MASS, 0.02, 0.01, unbalance=jr.Unbalance(eccentricity)),
        },
        {"air": (jr.LinearSupport(np.zeros(6), damping * np.array([1.0, 1, 0, 0, 0, 0])), "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed=None if twists else {"disc": {"phi": jr.ConstantSpeed(speed)}},
        gravity=(0.0, -gravity, 0.0),
    )


def harmonics(machine, speed):
    """Amplitudes of x + iy at -3 ... 3 times per turn in the steady state, complex, by order."""
    turn = 2 * np.pi / speed
    run = jr.simulate(
        machine, turn, 32 / turn, "steady", speed=speed, step=turn / 128, solver=jr.ETD4RK()
    )["disc"]
    z = np.fft.fft(np.asarray(run.x + 1j * run.y)[:32]) / 32
    return {n: z[n] for n in range(-3, 4)}


# The energy and its forces


def tip(qa, qb, angle):
    """What the right end does seen from the tangent at the left one, in the turning frame: a complex
    deflection and slope."""
    (wa, sa), (wb, sb) = ((q[0] + 1j * q[1], q[4] - 1j * q[3]) for q in (qa, qb))
    return np.array([wb - wa - L * sa, sb - sa]) * np.exp(-1j * angle)


def cantilever(yields=0.0):
    return np.array([[L**3 / 3 * (1 + yields / 4), L**2 / 2], [L**2 / 2, L]]) / EI


def both(F):
    """For the deflection and slope towards x, then towards y."""
    return np.kron(np.eye(2), F)


def hinge(depth, position, angle, mix, yields=0.0):
    """The flexibility of a crack's hinge, whose stiffness is mixed with that of the sound section."""
    arm = np.array([L * (1 - position), 1.0])
    c = np.asarray(crack_compliance(*map(jnp.asarray, (depth, 2 * R, E, NU))))
    F0, total = cantilever(yields), np.zeros((4, 4))
    for compliance, at in ((c[0], angle), (c[1], angle + np.pi / 2)):
        stiff = np.linalg.inv(F0)
        open_ = np.linalg.inv(F0 + compliance * np.outer(arm, arm))
        mixed = np.linalg.inv(stiff - mix * (stiff - open_)) - F0
        e = np.array([np.cos(at), np.sin(at)])
        total += np.kron(np.outer(e, e), mixed)
    return total


def energy_by_hand(shaft, qa, qb):
    """Beyond the sound section, from the flexibility of a cantilever."""
    phi = 0.5 * (qa[5] + qb[5])  # how far both ends have turned: chi
    u = tip(qa, qb, phi)
    u = np.concatenate([u.real, u.imag])
    yields = float(shaft._yield()) if shaft.shear else 0.0
    sound = F = both(cantilever(yields))
    free, cracks = u.copy(), []
    for flaw in shaft.flaw.parts:
        values = {k: float(v) for k, v in vars(flaw).items() if not isinstance(v, str)}
        if isinstance(flaw, (jr.elements.Bow, jr.elements.Kink)):
            e = np.array([np.cos(values["angle"]), np.sin(values["angle"])])
            if isinstance(flaw, jr.elements.Bow):
                gone = -values["sagitta"] * np.array([4.0, 8 / L])
            else:
                gone = values["bend"] * np.array([L * (1 - values["position"]), 1.0])
            free -= np.kron(e, gone)
        elif isinstance(flaw, jr.elements.Asymmetry):
            for sign, at in ((1, values["angle"]), (-1, values["angle"] + np.pi / 2)):
                e = np.array([np.cos(at), np.sin(at)])
                softer = (1 / (1 + sign * values["ratio"]) - 1) * cantilever()
                F = F + np.kron(np.outer(e, e), softer)
        else:
            cracks.append((flaw, values))
    for flaw, v in cracks:
        load = np.linalg.solve(sound, free)  # force and moment at the tip, each way
        arm = np.array([L * (1 - v["position"]), 1.0])
        moment = load.reshape(2, 2) @ arm  # EI w''
        side = np.array([np.cos(v["angle"]), np.sin(v["angle"])])
        cosine = np.cos(phi + v["angle"] - v["opens_at"])
        if getattr(flaw, "follows", "") == "moment":
            cosine = -side @ moment / np.linalg.norm(moment)
        mix = 0.5 * (1 + cosine)
        if isinstance(flaw, jr.elements.SwitchingCrack):
            mix = 0.5 * (1 + np.tanh(cosine / v["width"]))
        elif flaw.breathing == "open":
            mix = 1.0
        F = F + hinge(v["depth"], v["position"], v["angle"], mix, yields)
    return 0.5 * (free @ np.linalg.solve(F, free) - u @ np.linalg.solve(sound, u))


EVERY = (
    jr.elements.Bow(3e-4, 0.7),
    jr.elements.Kink(2e-3, 0.3, -1.1),
    jr.elements.Asymmetry(-0.15, 0.4),
    jr.elements.Crack(0.3, 0.2, 2.0),
    jr.elements.Crack(0.1, 0.9, -1.0, breathing="open"),
    jr.elements.SwitchingCrack(0.2, 0.6, 0.3, width=0.4),
    jr.elements.SwitchingCrack(0.25, 0.7, -0.3, follows="moment", width=0.5),
)


def test_forces_are_those_of_a_cantilever_with_hinges():
    """All flaws in one section, with shear: energy as assembled from a cantilever's flexibility,
    forces, moments and torque as its slopes."""
    shaft = jr.Shaft(L, 2 * R, shear=True, flaw=EVERY)
    sound = jr.Shaft(L, 2 * R, shear=True)
    rng = np.random.default_rng(1)
    qa, qb = rng.normal(size=(2, 6)) * np.array([1e-3, 1e-3, 1e-4, 1e-2, 1e-2, 1.0])
    still = np.zeros(6)

    @jax.jit
    def beyond(qa, qb):
        motions = ((qa, still), (qb, still))
        return shaft.energy(0.0, motions, None) - sound.energy(0.0, motions, None)

    for turned in (0.0, 1.0, 4.0):
        at = [q + np.eye(6)[5] * turned for q in (qa, qb)]
        by_hand = energy_by_hand(shaft, *at)
        assert abs(by_hand) > 1e-3
        np.testing.assert_allclose(beyond(*at), by_hand, rtol=1e-10)

    both = np.concatenate([qa, qb])
    slopes = []
    for step in 1e-6 * np.eye(12) * np.tile([1e-1, 1e-1, 1, 1, 1, 1e2], 2):
        near, far = (
            energy_by_hand(shaft, *np.split(both + n * step, 2))
            - energy_by_hand(shaft, *np.split(both - n * step, 2))
            for n in (1, 2)
        )
        slopes.append((8 * near - far) / (12 * step.sum()))
    motions = (jnp.asarray(qa), jnp.zeros(6)), (jnp.asarray(qb), jnp.zeros(6))
    force = pull(shaft, *motions) - pull(sound, *motions)
    np.testing.assert_allclose(force, -np.reshape(slopes, (2, 6)), rtol=1e-7, atol=1e-9)
    assert abs(force[0, 5]) > 1e-3  # it acts on the spin


def test_a_cracked_cantilever_sags_by_fracture_mechanics():
    """An open crack below a clamped, hanging disc: P (L³/3 + EI c (L - s)²)/EI."""
    weight = MASS * 9.81
    for angle, which in ((np.pi / 2, 0), (0.0, 1)):
        machine = jr.Machine.in_line(
            {
                "wall": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
                "shaft": jr.Shaft(
                    L, 2 * R, flaw=jr.elements.Crack(0.35, 0.1, angle, breathing="open")
                ),
                "disc": jr.Rotor(MASS, 0.02, 0.01),
            },
            gravity=(0.0, -9.81, 0.0),
        )
        sag = -jr.static_equilibrium(machine).position[1, 1]
        c = crack_compliance(*map(jnp.asarray, (0.35, 2 * R, E, NU)))[which]
        more = weight * float(c) * (0.9 * L) ** 2
        np.testing.assert_allclose(sag, weight * L**3 / (3 * EI) + more, rtol=1e-9)
        assert more > 5e-2 * sag if which == 0 else more > 1e-3 * sag


def test_compliance_of_a_crack():
    """The polynomial against adaptive quadrature; the published table; the closed form of shallow cracks."""

    def strip(x, y, shape):
        r = np.pi / 2 * y / (2 * np.sqrt(1 - x**2))
        return np.sqrt(np.tan(r) / r) * shape(r, np.sin(r)) / np.cos(r)

    def f1(r, s):
        return 0.752 + 2.02 * 2 * r / np.pi + 0.37 * (1 - s) ** 3

    def f2(r, s):
        return 0.923 + 0.199 * (1 - s) ** 4

    @jax.jit
    def ours(depth):
        return crack_compliance(depth, 2.0, 1.0, 0.0)

    for depth in (0.1, 0.27, 0.45):
        a = 2 * depth
        b = np.sqrt(a * (2 - a))
        bounds = (-b, b, 0.0, lambda x, a=a: np.sqrt(1 - x**2) - (1 - a))
        want = [
            dblquad(lambda y, x: 32 / np.pi * (1 - x**2) * y * strip(x, y, f2) ** 2, *bounds)[0],
            dblquad(lambda y, x: 32 / np.pi * x**2 * y * strip(x, y, f1) ** 2, *bounds)[0],
        ]
        np.testing.assert_allclose(ours(depth), want, rtol=1e-6)
    # Papadopoulos' values of c55 E R³/(1 - nu²) over a/R, as ROSS 2.3 has them (ross/faults/data)
    table = {0.1: 0.0277722, 0.2: 0.144614, 0.4: 0.72488, 0.6: 1.8922, 0.8: 3.97355, 1.0: 7.79039}
    for a, value in table.items():
        np.testing.assert_allclose(ours(a / 2)[0], value, rtol=3e-6)
    # a shallow one is an edge crack in a half space, K = 1.122 sigma sqrt(pi y), y = a - x²/2
    a = 1e-4
    opening = 32 / np.pi * 1.122**2 * 8 * np.sqrt(2) / 15 * a**2.5
    across = 16 / np.pi * 1.122**2 * (2 * a) ** 1.5 * a**2 * 16 / 105
    np.testing.assert_allclose(ours(a / 2), [opening, across], rtol=1e-3)
    slope = jax.jacfwd(ours)(0.0)
    np.testing.assert_array_equal(slope, 0.0)  # and no NaN


def test_a_keyway():
    """Moments of area by quadrature; the round shaft of the same mean."""
    d, w, t = 0.04, 0.012, 0.005
    mean_diameter, asymmetry = jr.elements.keyway(d, w, t, 0.2)

    def width(y):  # what is left of the section at y
        half = np.sqrt((d / 2) ** 2 - y**2)
        return half, min(half, w / 2) if y > d / 2 - t else 0.0

    def integral(f):
        corners = [d / 2 - t, np.sqrt(d**2 - w**2) / 2]
        return quad(lambda y: f(y, *width(y)), -d / 2, d / 2, points=corners, epsabs=0)[0]

    area = integral(lambda y, half, slot: 2 * (half - slot))
    centre = integral(lambda y, half, slot: 2 * (half - slot) * y) / area
    towards = integral(lambda y, half, slot: 2 * (half - slot) * (y - centre) ** 2)
    beside = integral(lambda y, half, slot: 2 / 3 * (half**3 - slot**3))
    ratio = (towards - beside) / (towards + beside)
    np.testing.assert_allclose(asymmetry.ratio, ratio, rtol=1e-7)
    np.testing.assert_allclose(np.pi / 64 * mean_diameter**4, (towards + beside) / 2, rtol=1e-8)
    assert asymmetry.ratio < -0.05 and asymmetry.angle == 0.2
    with pytest.raises(jr.InputError, match="does not go into a shaft of 40 mm"):
        jr.elements.keyway(d, w, 0.025)


def test_a_bowed_rotor():
    """Nicholas, Gunter & Allaire (1976): the whirl of a rotor with residual bow and unbalance, amplitude and
    phase; where one hides the other the rotor stands still."""
    bend, e, c = 2e-3, 3e-5, 25.0
    # clamped and guided: the disc would rest where the moment at the kink, 6 EI/L² (2 s - 1) x, is balanced
    bow = 6 * EI / L**2 * 0.6 * bend / K
    quiet = np.sqrt(K * bow / (MASS * e))
    assert 0.3 * CRITICAL < quiet < 3 * CRITICAL
    for speed, damping in ((20.0, c), (CRITICAL, c), (300.0, c), (quiet, 0.0)):
        machine = jeffcott(speed, bend, eccentricity=e, damping=damping)
        # the disc's unbalance at 0, its bow at 0.5 + pi; opposed where it shall stand still
        towards = 0.5 + np.pi
        if speed == quiet:
            machine = machine.set({"shaft.flaw.parts.0.angle": 0.0})
            towards = np.pi
        whirl = (K * bow * np.exp(1j * towards) + MASS * e * speed**2) / (
            K - MASS * speed**2 + 1j * damping * speed
        )
        found = harmonics(machine, speed)
        np.testing.assert_allclose(found[1], whirl, rtol=1e-6, atol=1e-6 * bow)
        assert abs(found[0]) + abs(found[2]) < 1e-8 * bow
        # the same from the linear machine, whose disc is free to twist (which counts as m e²/Jp, 1e-7)
        free = jeffcott(
            speed, eccentricity=e, damping=damping, flaw=machine["shaft"].flaw, twists=True
        )
        linear = jr.unbalance_response(free, ("disc.x", "disc.y"), speed).values[0]
        np.testing.assert_allclose(linear, [whirl, -1j * whirl], rtol=3e-7, atol=3e-7 * bow)


def test_the_arc_of_a_long_bow():
    """Pinned at both ends, two halves with a quarter of the sagitta each: the middle lies the whole of it off
    the axis, and nothing is loaded; so too where the middle is bent."""
    for flaw, off in (
        (jr.elements.Bow(1e-4, 0.3), 4e-4),
        (jr.elements.Kink(4e-4 / L, 0.0, 0.3 + np.pi), 2e-4),
    ):
        ends = dict(polar_inertia=1e-3, transverse_inertia=1e-3)
        first = flaw if isinstance(flaw, jr.elements.Bow) else None
        machine = jr.Machine.in_line(
            {
                "a": jr.Rotor(1.0, **ends),
                "left": jr.Shaft(L, 2 * R, flaw=first, twist="paper"),
                "disc": jr.Rotor(MASS, 0.02, 0.01),
                "right": jr.Shaft(L, 2 * R, flaw=flaw, twist="paper"),
                "b": jr.Rotor(1.0, **ends),
            },
            fixed={"a": ("x", "y", "z", "phi"), "b": ("x", "y", "z")},
        )
        state = jr.static_equilibrium(machine)
        middle = state.position[machine.wiring.stations.index("disc")]
        np.testing.assert_allclose(
            middle[:2], off * np.array([np.cos(0.3), np.sin(0.3)]), rtol=1e-9
        )
        motions = [(q, jnp.zeros(6)) for q in (state.position[0], middle)]
        assert abs(float(jnp.max(jnp.abs(pull(machine["left"], *motions))))) < 1e-9


def monodromy(machine, speed):
    """What a turn makes of small coordinates and rates (x, y, x', y'), from four runs."""
    turn, columns = 2 * np.pi / speed, []
    for k, size in enumerate((1e-6, 1e-6, 1e-4, 1e-4)):
        y = size * np.eye(4)[k]
        q, v = np.zeros((2, 2, 6))
        q[1, :2], v[1, :2], v[:, 5] = y[:2], y[2:], speed
        start = jr.State(jnp.asarray(q), jnp.asarray(v))
        run = jr.simulate(machine, turn, 16 / turn, start, step=turn / 128, solver=jr.ETD4RK())[
            "disc"
        ]
        columns.append(np.concatenate([run.position[16, :2], run.velocity[16, :2]]) / size)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("damping", [0.0, 30.0])
def test_an_asymmetric_shaft_is_unstable_between_its_critical_speeds(damping):
    """In the turning frame a standing solution exists where (k1 - m W²)(k2 - m W²) + (c W)² = 0: the edges
    of the unstable range, sqrt(k1/m) and sqrt(k2/m) without damping. There a turn has the multiplier 1."""
    ratio = 0.1

    def at(speed):
        return monodromy(jeffcott(speed, ratio=ratio, damping=damping), speed)

    k = K * np.array([1 - ratio, 1 + ratio]) / MASS
    edges = np.sqrt(np.sort(np.roots([1, (damping / MASS) ** 2 - k.sum(), k.prod()])))
    for edge, inside in zip(edges, (1, -1)):
        near = [edge - 0.3, edge + 0.3]
        found = brentq(lambda w: np.linalg.det(at(w) - np.eye(4)), *near, xtol=1e-5)
        np.testing.assert_allclose(found, edge, rtol=1e-8)
        assert max(abs(np.linalg.eigvals(at(edge + 2.0 * inside)))) > 1.01
    assert max(abs(np.linalg.eigvals(at(edges[0] - 2.0)))) < 1 + 1e-9


def test_an_asymmetric_shaft_under_weight():
    """x + iy = A + B e^(2i(phi + a)), exactly: `k A + k d conj(B) = -i m g` and
    `(k - 4 m W² + 2i c W) B + k d conj(A) = 0`. Largest at half the critical speed."""
    ratio, damping, g = 0.05, 20.0, 9.81
    for speed in (0.3 * CRITICAL, 0.5 * CRITICAL, 0.7 * CRITICAL):
        found = harmonics(jeffcott(speed, ratio=ratio, damping=damping, gravity=g), speed)
        dynamic = K - 4 * MASS * speed**2 + 2j * damping * speed
        turned = K * ratio * np.exp(0.6j)
        # B = -turned conj(A)/dynamic, into the first
        A = -1j * MASS * g / (K - abs(turned) ** 2 / np.conj(dynamic))
        B = -turned * np.conj(A) / dynamic
        np.testing.assert_allclose([found[0], found[2]], [A, B], rtol=1e-6)
        assert abs(found[1]) < 1e-8 * abs(A)


def by_scipy(speed, opening, depth, damping, eccentricity, gravity, times):
    """A cracked guided section and its disc, written out by hand for SciPy. `opening`: a function of the
    angle between the crack's side and x."""
    arm = np.array([0.9 * L, 1.0])
    c = crack_compliance(*map(jnp.asarray, (depth, 2 * R, E, NU)))
    open_ = [np.linalg.inv(cantilever() + float(one) * np.outer(arm, arm))[0, 0] for one in c]

    def field(t, y):
        at = speed * t + 0.4
        k = K - opening(at) * (K - np.array(open_))
        turn = np.array([[np.cos(at), -np.sin(at)], [np.sin(at), np.cos(at)]])
        force = -turn @ (k * (turn.T @ y[:2])) - damping * y[2:] - [0.0, MASS * gravity]
        whirl = np.array([np.cos(speed * t), np.sin(speed * t)])
        return np.concatenate([y[2:], force / MASS + eccentricity * speed**2 * whirl])

    options = dict(
        method="DOP853", rtol=1e-11, atol=1e-15, t_eval=times, max_step=0.02 / speed * 10
    )
    return solve_ivp(field, (0.0, times[-1]), np.zeros(4), **options).y[:2]


def test_a_breathing_crack_by_the_default_solver():
    """From rest under weight and unbalance at half the critical speed: SciPy, on equations of its own."""
    speed, common = 0.5 * CRITICAL, dict(depth=0.3, damping=40.0, eccentricity=1e-5, gravity=9.81)
    run = jr.simulate(jeffcott(speed, **common), 0.2, 1000.0, "undeformed")
    want = by_scipy(speed, lambda at: 0.5 * (1 - np.sin(at)), times=np.asarray(run.t), **common)
    error = np.abs(np.stack([run["disc"].x, run["disc"].y]) - want)
    assert run.info.solver == "ExponentialAdams"
    assert np.max(error) < 5e-7 * np.max(np.abs(want))  # and the pilot's estimate, 6e-7


def test_twice_per_turn_grows_with_the_crack():
    """At half the critical speed: nothing twice per turn without a crack; with one it grows with the depth,
    and is far larger there than at other speeds."""
    speed, common = 0.5 * CRITICAL, dict(damping=20.0, eccentricity=1e-6, gravity=9.81)
    sag = MASS * 9.81 / K
    depths = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
    twice = [abs(harmonics(jeffcott(speed, depth=a, **common), speed)[2]) for a in depths]
    assert twice[0] < 1e-9 * sag
    assert np.all(np.diff(twice) > 0) and twice[-1] > 0.2 * sag
    for other in (0.4 * CRITICAL, 0.6 * CRITICAL):
        away = abs(harmonics(jeffcott(other, depth=0.2, **common), other)[2])
        assert away < 0.2 * twice[3]


def test_switching_cracks():
    """SciPy again; the width of the switch hardly matters; and a crack that follows the section's moment
    follows the weight where there is nothing else: at a clamped end the upper side is pulled."""
    speed, common = 0.4 * CRITICAL, dict(damping=40.0, eccentricity=1e-5, gravity=9.81)
    runs = []
    for width in (0.1, 0.05):
        flaw = jr.elements.SwitchingCrack(0.3, 0.1, 0.4, width=width)
        machine = jeffcott(speed, flaw=flaw, **common)
        assert not is_smooth(machine) and is_smooth(jeffcott(speed))
        run = jr.simulate(machine, 0.1, 1000.0, "undeformed", step=1e-4, solver=jr.ETD4RK())
        runs.append(np.stack([run["disc"].x, run["disc"].y]))

        def opening(at, width=width):
            return 0.5 * (1 - np.tanh(np.sin(at) / width))

        want = by_scipy(speed, opening, 0.3, times=np.asarray(run.t), **common)
        np.testing.assert_allclose(runs[-1], want, atol=1e-6 * np.max(np.abs(want)))
    assert np.max(np.abs(runs[0] - runs[1])) < 1e-3 * np.max(np.abs(runs[0]))

    hanging = np.array([0.0, -1e-3, 0, 0, 0, 0])
    for turned in np.linspace(0, 6, 7):
        at = [
            (jnp.asarray(q + np.eye(6)[5] * turned), jnp.zeros(6)) for q in (0 * hanging, hanging)
        ]
        stored = [
            jr.Shaft(L, 2 * R, flaw=flaw).energy(0.0, at, None)
            for flaw in (
                jr.elements.SwitchingCrack(0.3, 0.1, 0.4, opens_at=np.pi / 2),
                jr.elements.SwitchingCrack(0.3, 0.1, 0.4, follows="moment"),
            )
        ]
        np.testing.assert_allclose(stored[0], stored[1], rtol=1e-9)


def test_energy_is_kept():
    """Free in space, spinning, bent and cracked in every way: kinetic and elastic energy add up, for what
    turns with the shaft acts on its spin."""
    machine = jr.Machine.in_line(
        {
            "a": jr.Rotor(2.0, 0.012, 0.008, unbalance=jr.Unbalance(1e-3, 0.4, 0.02, 1.0)),
            "shaft": jr.Shaft(0.3, 0.012, flaw=EVERY),
            "b": jr.Rotor(3.0, 0.010, 0.006, unbalance=jr.Unbalance(5e-4, -1.0)),
        },
    )
    audit = jr.energy_audit(machine, 0.04, 2000.0, "undeformed", speed=150.0, step=1.25e-5)
    assert float(jnp.ptp(audit.elastic)) > 1e-2
    assert float(audit.relative) < 1e-8


def test_derivatives_of_a_run():
    """The disc's path by the crack's depth and place, the kink, the asymmetry: three ways."""
    speed = 100.0
    base = jeffcott(speed, damping=20.0, eccentricity=1e-5, gravity=9.81)
    names = ["0.bend", "0.angle", "1.ratio", "2.depth", "2.position", "2.opens_at"]

    def path(x):
        machine = base.set({f"shaft.flaw.parts.{n}": x[i] for i, n in enumerate(names)})
        run = jr.simulate(machine, 0.02, 1000.0, "undeformed", step=5e-4, solver=jr.ETD4RK())
        return 1e3 * run["disc"].position[5::5, :2]

    found = assert_derivatives_agree(path, [1e-3, 0.2, 0.1, 0.25, 0.1, -1.5], step=1e-4, rtol=1e-6)
    assert np.all(np.max(np.abs(found), axis=(0, 1)) > 1e-5)


STUDY = """
[machine]
gravity = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]

[[machine.line]]
name = "drive"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "1000 rpm" }

[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "300 mm"
diameter = "12 mm"
flaw = { kind = "Crack", depth = 0.2, angle = "90 deg", breathing = "open" }

[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.01 kg*m^2"

[[machine.line]]
name = "stub"
kind = "Shaft"
length = "100 mm"
diameter = "12 mm"

[machine.line.flaw]
kind = "ShaftDefects"
parts = [{ kind = "Bow", sagitta = "0.1 mm" }, { kind = "Asymmetry", ratio = 0.1 }]

[[machine.line]]
name = "end"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.01 kg*m^2"

[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""


def test_study_files(tmp_path):
    from jaxrotor.commands.save_study import save_study

    file = tmp_path / "cracked.toml"
    file.write_text(STUDY)
    study = jr.load(file)
    assert study.machine["shaft"].flaw == jr.elements.Crack(0.2, angle=np.pi / 2, breathing="open")
    assert float(study.machine.get("stub.flaw.parts.0.sagitta")) == 1e-4
    deeper = study.machine.set({"shaft.flaw.depth": 0.3, "stub.flaw.parts.0.sagitta": 2e-4})
    save_study(
        study, deeper, ["shaft.flaw.depth", "stub.flaw.parts.0.sagitta"], tmp_path / "b.toml"
    )
    again = jr.load(tmp_path / "b.toml").machine
    assert again["shaft"].flaw == deeper["shaft"].flaw
    assert again["stub"].flaw.parts[0] == deeper["stub"].flaw.parts[0]
    assert float(jr.load("configs/cracked_shaft.toml").machine.get("cracked.flaw.depth")) == 0.25
    file.write_text(STUDY.replace("depth = 0.2", "depth = 0.7").replace('"Bow"', '"Bough"'))
    with pytest.raises(jr.InputError) as caught:
        jr.load(file)
    told = "\n".join(caught.value.problems)
    assert "depth must be at most 0.5" in told and "did you mean" in told


@pytest.mark.parametrize(
    "flaw, more, sentence",
    [
        (
            jr.elements.Crack(0.6),
            {},
            "`s`: depth must be at most 0.5 of the diameter .*, but is 0.6",
        ),
        (jr.elements.Crack(-0.1), {}, "`s`: flaw.depth must be zero or positive, but is -0.1"),
        (
            jr.elements.Crack(0.1, 1.5),
            {},
            "position must lie between 0 and 1 along the section, but is 1.5",
        ),
        (
            lambda: jr.elements.Crack(0.1, breathing="cosin"),
            {},
            "breathing must be 'cosine' or 'open', but is 'cosin': did you mean 'cosine'",
        ),
        (
            jr.elements.Crack(0.1),
            dict(inner_diameter=0.01),
            "a solid section alone, but inner_diameter is 0.01",
        ),
        (jr.elements.Kink(0.1, -0.5), {}, "flaw.position must be zero or positive, but is -0.5"),
        (
            jr.elements.SwitchingCrack(0.1, width=0.0),
            {},
            "flaw.width must be positive, but is 0 rad",
        ),
        (jr.elements.Asymmetry(1.0), {}, "ratio must lie between -1 and 1, .*, but is 1"),
        ((), {}, "parts must hold one defect at least, but is empty"),
        (jr.Unbalance(), {}, "flaw must be made by Bow, Kink, .*, but is Unbalance"),
        ((jr.elements.Bow(1e-4), 3.0), {}, "flaw.parts.1 must be made by .*, but is 3.0"),
    ],
)
def test_wrong_flaws(flaw, more, sentence):
    rotor = jr.Rotor(1.0, 0.01, 0.01)
    with pytest.raises(jr.InputError, match=sentence):
        flaw = flaw() if callable(flaw) else flaw
        jr.Machine.in_line({"a": rotor, "s": jr.Shaft(L, 0.02, flaw=flaw, **more), "b": rotor})
