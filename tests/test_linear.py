"""Linear analysis: MOD-02, MOD-04, BRG-03, BRG-05, a spinning Timoshenko shaft, derivatives, and that the
two halves, linear and in time, tell the same."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import TIGHT
from scipy.optimize import brentq

import jaxrotor as jr

RPM = np.pi / 30


def nearest(found, wanted):
    found = np.asarray(found)
    return np.array([found[np.argmin(np.abs(found - w))] for w in wanted])


# MOD-04: Friswell et al. 2010, Ex. 6.8.1 and 6.9.1, Tables 6.3 and 6.4 (printed by ROSS, example 25).
BEARINGS = {  # kxx, kyy in MN/m, cxx, cyy in kN s/m
    1: (10, 10, 0, 0),
    2: (10, 20, 0, 0),
    3: (10, 20, 60, 60),
    4: (10, 20, 400, 400),
    5: (0.2, 0.4, 0, 0),
}
ROOTS = [
    (0, 1, 1, [44.322j, 44.322j, 397.537j, 397.537j]),
    (0, 2, 2, [44.322j, 44.408j, 397.537j, 400.142j]),
    (0, 2, 3, [-0.038 + 44.332j, -0.010 + 44.409j, -1.219 + 400.564j, -0.850 + 401.182j]),
    (0, 2, 4, [-0.066 + 44.438j, -0.038 + 44.442j, -0.211 + 401.037j, -0.209 + 401.849j]),
    (0, 5, 5, [37.630j, 40.664j, 226.242j, 281.853j]),
    (1000, 1, 1, [42.250j, 46.404j, 389.801j, 402.327j]),
    (1000, 2, 3, [-0.020 + 42.292j, -0.028 + 46.460j, -0.617 + 391.899j, -1.358 + 406.609j]),
    (2000, 2, 3, [-0.017 + 40.243j, -0.033 + 48.539j, -0.189 + 377.688j, -1.607 + 410.454j]),
    (3000, 2, 3, [-0.014 + 38.241j, -0.039 + 50.592j, -0.000 + 356.968j, -1.788 + 413.175j]),
]


def overhung(left, right):
    steel = jr.Material(2.11e11, 2.11e11 / 2.6, 7810.0)

    def bearing(case):
        kx, ky, cx, cy = BEARINGS[case]
        return jr.LinearSupport([1e6 * kx, 1e6 * ky, 0, 0, 0, 0], [1e3 * cx, 1e3 * cy, 0, 0, 0, 0])

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": jr.FiniteElementShaft(1.0, 0.025, material=steel, elements=4),
            "right": jr.Node(),
            "shaft 2": jr.FiniteElementShaft(0.5, 0.025, material=steel, elements=2),
            "disc": jr.Rotor(15.3, 0.12, 0.062),
        },
        attachments={"bearing 1": (bearing(left), "left"), "bearing 2": (bearing(right), "right")},
        fixed={"left": ("z",)},
    )


@pytest.mark.parametrize("rpm, left, right, roots", ROOTS)
def test_mod_04_roots(rpm, left, right, roots):
    model = jr.linearize(overhung(left, right), rpm * RPM, at="undeformed")
    found = nearest(model.eigenvalues, np.array(roots))
    np.testing.assert_allclose(found.imag, np.imag(roots), atol=6e-4)
    np.testing.assert_allclose(found.real, np.real(roots), atol=6e-4)


def test_mod_04_critical_speeds():
    """Half the last printed digit of speeds in rpm."""
    expected = [358.43, 389.35, 2123.79, 2659.1, 3118.14]
    found = nearest(jr.critical_speeds(overhung(5, 5)) / RPM, expected)
    assert np.all(np.abs(found - expected) <= [0.005, 0.005, 0.005, 0.05, 0.005])


# BRG-05: Stodola 1927, Green 1948.
GREEN = {
    0: [412.4266114992187, 1916.4760335358867],
    100: [396.4111340226788, 428.54342863386415, 1849.5401611311966, 1988.363100922551],
    1000: [270.270559968907, 563.0239683275937, 1438.0883185740938, 2854.8872542407853],
}


def stodola(**options):
    shaft = jr.Shaft(0.1, 0.012, material=jr.Material(2.1e11, 8.1e10, 7850.0), **options)
    return jr.Machine.in_line(
        {
            "wall": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "shaft": shaft,
            "disc": jr.Rotor(3.0935, 0.00485, 0.002837, unbalance=jr.Unbalance(1e-5)),
        }
    )


def test_brg_05_stodola_green():
    machine = stodola()
    for speed, expected in GREEN.items():
        model = jr.linearize(machine, speed, at="undeformed")
        np.testing.assert_allclose(
            nearest(model.damped_frequencies, expected), expected, rtol=1e-10
        )
        found = {m.name: m.frequency for m in jr.modes(model)}
        if speed:
            assert found["1 backward"] == pytest.approx(expected[0])
            assert found["1 forward"] == pytest.approx(expected[1])
    critical = [356.4814121898121, 490.5469505610065, 1346.9901203123886]
    np.testing.assert_allclose(nearest(jr.critical_speeds(machine), critical), critical, rtol=1e-10)


def jeffcott(ce, ci, k=1e4, m=1.0):
    """A disc on an isotropic shaft of stiffness k with internal damping, in external damping."""
    L = 0.2
    moment = k * L**3 / (12 * 2.1e11)  # guided at both ends: 12 EI/L³
    d = (64 * moment / np.pi) ** 0.25
    return jr.Machine.in_line(
        {
            "wall": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "shaft": jr.Shaft(L, d, rayleigh=(0.0, ci / k), damping="rotating"),
            "disc": jr.Rotor(m, 0.01, 0.006),
        },
        attachments={"air": (jr.LinearSupport([0] * 6, [ce, ce, 0, 0, 0, 0]), "disc")},
        fixed={"disc": ("z", "psi", "theta")},
    )


def test_brg_03_onset_of_instability():
    """w0 (1 + c_e/c_i) = 300 rad/s."""
    machine = jeffcott(4.0, 2.0)
    found = jr.stability_threshold(machine, 100.0, 500.0)
    assert float(found) == pytest.approx(300.0, rel=1e-9)
    assert float(jr.linearize(machine, 299.0, at="undeformed").growth) < 1e-6
    assert float(jr.linearize(machine, 301.0, at="undeformed").growth) > 1e-3
    # its derivative by the external damping: w0/c_i
    slope = jax.grad(
        lambda c: jr.stability_threshold(
            machine.set({"air.damping": jnp.zeros(6).at[:2].set(c)}), 100.0, 500.0
        )
    )(4.0)
    assert float(slope) == pytest.approx(50.0, rel=1e-8)
    with pytest.raises(
        jr.InputError, match="no threshold from 100 to 200 rad/s: the machine is stable"
    ):
        jr.stability_threshold(machine, 100.0, 200.0)


def test_a_spinning_timoshenko_shaft():
    """Pinned, closed form with gyroscopic moments (Rayleigh's and shear's terms): 1e-4."""
    E, nu, rho, L, r, speed = 2.11e11, 0.3, 7860.0, 0.5, 0.02, 3000.0
    G, A, I = E / 2 / (1 + nu), np.pi * r**2, np.pi * r**4 / 4
    kappa = 6 * (1 + nu) / (7 + 6 * nu)

    def missing(w, k):  # w > 0 whirls forward, w < 0 backward
        share = (k**2 - rho * w**2 / (kappa * G)) / k
        return kappa * G * A * k - share * (
            kappa * G * A + E * I * k**2 - rho * I * w**2 + 2 * rho * I * speed * w
        )

    expected = []
    for n in (1, 2):
        k = n * np.pi / L
        w0 = k**2 * np.sqrt(E * I / (rho * A))
        for sign in (1, -1):
            expected.append(
                abs(
                    brentq(
                        lambda w, k=k: missing(w, k), *sorted((sign * 0.7 * w0, sign * 1.1 * w0))
                    )
                )
            )
    machine = jr.Machine.in_line(
        {
            "a": jr.Node(),
            "shaft": jr.FiniteElementShaft(L, 2 * r, material=jr.Material(E, G, rho), elements=40),
            "b": jr.Node(),
        },
        fixed={"a": ("x", "y", "z"), "b": ("x", "y")},
    )
    model = jr.linearize(machine, speed, at="undeformed")
    np.testing.assert_allclose(nearest(model.damped_frequencies, expected), expected, rtol=1e-4)
    split = (expected[0] - expected[1]) / expected[0]
    assert split > 1e-2  # the gyroscopic effect is there to be seen


def test_matrices_of_a_free_disc_on_springs():
    """M, C, G, K by hand."""
    k, c = np.array([2e5, 3e5, 1e5, 400.0, 500.0, 60.0]), np.array([20.0, 30, 10, 0.4, 0.5, 0.0])
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(2.0, 0.02, 0.012)}, attachments={"s": (jr.LinearSupport(k, c), "d")}
    )
    model = jr.linearize(machine, 150.0, at="undeformed")
    np.testing.assert_allclose(model.M, np.diag([2, 2, 2, 0.012, 0.012, 0.02]), atol=1e-14)
    np.testing.assert_allclose(model.K, np.diag(k), atol=1e-7)
    np.testing.assert_allclose(model.C, np.diag(c), atol=1e-10)
    G = np.zeros((6, 6))
    G[3, 4], G[4, 3] = 0.02 * 150, -0.02 * 150
    np.testing.assert_allclose(model.G, G, atol=1e-12)
    assert model.coordinates[3] == ("d", "psi")


# Derivatives


def damped_overhung(x):
    """Everything about it as one vector, so that each entry is a parameter."""
    steel = jr.Material(x[0], x[1], x[2])
    support = jr.LinearSupport(
        jnp.stack([x[3], x[4], 0.0, 0.0, 0.0, 0.0]), jnp.stack([x[5], x[6], 0.0, 0.0, 0.0, 0.0])
    )
    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": jr.FiniteElementShaft(x[7], x[8], material=steel, elements=2),
            "right": jr.Node(),
            "shaft 2": jr.FiniteElementShaft(x[9], x[10], material=steel, elements=1),
            "disc": jr.Rotor(x[11], x[12], x[13]),
        },
        attachments={"b1": (support, "left"), "b2": (support, "right")},
        fixed={"left": ("z",)},
    )


PARAMETERS = jnp.array(
    [2.11e11, 8.1e10, 7810.0, 2e6, 4e6, 600.0, 900.0, 1.0, 0.025, 0.5, 0.026, 15.3, 0.12, 0.062]
)


def central(f, x, i, h):
    d = jnp.zeros(x.size).at[i].set(h)
    return (8 * (f(x + d) - f(x - d)) - (f(x + 2 * d) - f(x - 2 * d))) / (12 * h)


def test_derivatives_of_eigenvalues_and_critical_speeds():
    """By every parameter, forward, reverse and by differences: frequencies, damping ratios, the first
    critical speeds and the peak of the unbalance response."""

    def of_modes(x):
        model = jr.linearize(damped_overhung(x), 100.0, at="undeformed")
        return jnp.concatenate([model.natural_frequencies[:4], 1e2 * model.damping_ratios[:4]])

    def critical(x):
        return jr.critical_speeds(damped_overhung(x), count=3)

    # apart: compiled quickly, XLA 0.10 gives wrong tangents of one linearisation beside another
    eye = np.eye(PARAMETERS.size)
    for quantities in (of_modes, critical):
        # one program for values and tangents, one direction at a time: values alone are asked for 56 times
        ahead = jax.jit(lambda x, d, f=quantities: jax.jvp(f, (x,), (d,)))
        got = np.stack([ahead(PARAMETERS, d)[1] for d in eye], axis=1)
        back = jax.jit(jax.jacrev(quantities))(PARAMETERS)
        scale = np.abs(got * np.asarray(PARAMETERS)).max(axis=1, keepdims=True)
        np.testing.assert_allclose(back * PARAMETERS / scale, got * PARAMETERS / scale, atol=1e-9)
        for i, value in enumerate(np.asarray(PARAMETERS)):
            expected = central(lambda x, f=ahead: f(x, eye[0])[0], PARAMETERS, i, 1e-3 * value)
            np.testing.assert_allclose(
                got[:, i] * value / scale[:, 0], expected * value / scale[:, 0], atol=1e-6
            )


def test_repeated_eigenvalues_of_a_symmetric_machine():
    """An isotropic disc at rest: a change that keeps the symmetry has an exact derivative; one that breaks
    it (stiffness along x alone) moves the pair's mean by half, and parts it as split_derivatives says."""
    k = 1e4

    def disc(kx, ky):
        support = jr.LinearSupport(jnp.stack([kx, ky, 3 * k, 50.0, 50.0, 10.0]), [0] * 6)
        return jr.Machine.in_line(
            {"d": jr.Rotor(1.0, 0.01, 0.006)}, attachments={"s": (support, "d")}
        )

    def pair(kx, ky):
        found = jr.linearize(disc(kx, ky), 0.0, at="undeformed").damped_frequencies
        return found[jnp.argsort(jnp.abs(found - 100.0))[:2]]

    both = jax.jit(jax.jacfwd(lambda s: pair(s, s)))(k)
    np.testing.assert_allclose(both, 0.5 / 100.0, rtol=1e-8)  # sqrt(k/m)' = 1/(2 w m)
    one = jax.jit(jax.jacrev(lambda s: pair(s, jnp.asarray(k))))(k)
    np.testing.assert_allclose(one, 0.25 / 100.0, rtol=1e-8)

    def matrix(s):
        return jr.linearize(disc(s, jnp.asarray(k)), 0.0, at="undeformed").A

    A, dA = jax.jit(lambda s: jax.jvp(matrix, (s,), (1.0,)))(k)
    which = int(np.argmin(np.abs(np.linalg.eigvals(np.asarray(A)) - 100j)))
    parted = np.sort(np.asarray(jr.linear.split_derivatives(A, dA, which)).imag)
    np.testing.assert_allclose(parted, [0.0, 0.5 / 100.0], atol=1e-9)


def test_batches_over_speeds_and_parameters():
    speeds = jnp.array([0.0, 50.0, 400.0])
    over = jax.vmap(lambda w: jr.linearize(stodola(), w, at="undeformed").damped_frequencies)
    batch = jax.jit(over)(speeds)
    for w, found in zip(speeds, batch):
        alone = jr.linearize(stodola(), w, at="undeformed").damped_frequencies
        np.testing.assert_allclose(found, alone, rtol=1e-12)
    masses = jnp.array([2.0, 4.0])
    over = jax.vmap(lambda m: jr.critical_speeds(stodola().set({"disc.mass": m}), count=2))
    found = jax.jit(over)(masses)
    for m, critical in zip(masses, found):
        alone = jr.critical_speeds(stodola().set({"disc.mass": m}))[:2]
        np.testing.assert_allclose(critical, alone, rtol=1e-12)


# Both halves


def test_a_mode_in_time_is_its_eigenvalue():
    """A free transient started in a mode's shape stays there: e^(lambda t), to 1e-6 of its start."""
    machine = stodola(rayleigh=(3.0, 2e-5)).set({"disc.unbalance.eccentricity": 0.0})
    model = jr.linearize(machine, 0.0, at="undeformed")
    k = int(np.argmin(np.abs(np.asarray(model.damped_frequencies) - GREEN[0][1])))
    value, shape = complex(model.eigenvalues[k]), np.asarray(model.mode_shapes[:, k]) * 1e-7
    q, v = np.zeros((2, 2, 6))
    q[1], v[1] = shape.real, (value * shape).real
    t = np.arange(41) * 5e-4
    run = jr.simulate(machine, 0.02, 2000.0, jr.State(q, v), **TIGHT)["disc"].position
    expected = (shape[None] * np.exp(value * t)[:, None]).real
    np.testing.assert_allclose(run, expected, atol=1e-6 * np.abs(expected).max())
    assert np.abs(expected[-1]).max() < 0.7 * np.abs(expected[0]).max()


def test_steady_whirl_is_the_unbalance_response():
    """Shooting on the nonlinear machine against the linear response, static and dynamic unbalance."""
    machine = stodola(rayleigh=(0.0, 1e-4))
    machine = machine.set(
        {"disc.unbalance": jr.Unbalance(2e-7, 0.4, 3e-7, -0.5), "wall.profile.speed": 300.0}
    )
    response = jr.unbalance_response(
        machine, ("disc.x", "disc.y", "disc.psi", "disc.theta"), [300.0]
    )
    run = jr.simulate(machine, 0.05, 4000.0, "steady")
    turn = np.exp(1j * 300.0 * np.asarray(run.t))
    expected = (np.asarray(response.values)[0][None] * turn[:, None]).real
    found = np.asarray(run["disc"].position)[:, [0, 1, 3, 4]]
    assert np.all(np.abs(found - expected) < 1e-6 * np.abs(expected).max(axis=0))
    assert np.all(np.abs(expected).max(axis=0) > 1e-8)


def test_no_whirl_at_an_undamped_critical_speed():
    """sqrt(k/m) without damping: shooting gives 1e8 m there, which is rounding; beside it the whirl has a
    size."""

    def machine(speed):
        return jr.Machine.in_line(
            {"d": jr.Rotor(1.0, 0.01, 0.006, unbalance=jr.Unbalance(1e-6))},
            attachments={"s": (jr.LinearSupport([1e4] * 2 + [0] * 4), "d")},
            fixed={"d": ("z", "psi", "theta")},
            prescribed={"d": {"phi": jr.ConstantSpeed(speed)}},
        )

    with pytest.raises(jr.ConvergenceError, match="without damping a mode is in resonance"):
        jr.simulate(machine(100.0), 0.01, 1000.0, "steady")
    run = jr.simulate(machine(100.001), 0.01, 1000.0, "steady")["d"]
    w = 100.001
    np.testing.assert_allclose(np.hypot(run.x, run.y), 1e-6 * w**2 / (w**2 - 1e4), rtol=1e-5)


def test_a_slow_run_up_meets_the_unbalance_response():
    """Through the resonance so slowly (0.02 rad/s²) that the whirl is steady at every speed: 1e-4 of the
    peak, lag included."""
    m, k, c, e = 1.0, 1e4, 40.0, 1e-6
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(m, 0.01, 0.006, unbalance=jr.Unbalance(e))},
        attachments={"s": (jr.LinearSupport([k] * 2 + [0] * 4, [c] * 2 + [0] * 4), "d")},
        fixed={"d": ("z", "psi", "theta")},
        prescribed={"d": {"phi": jr.LinearRamp(speed=101.0, duration=200.0, start=97.0)}},
    )
    start = jr.unbalance_response(machine, ("d.x", "d.y"), [97.0])
    x = np.asarray(start.values)[0]
    q, v = np.zeros((2, 1, 6))
    q[0, :2], v[0, :2], v[0, 5] = x.real, (97j * x).real, 97.0
    run = jr.simulate(machine, 200.0, 20.0, jr.State(q, v))["d"]
    sample = slice(400, None, 20)
    speeds = np.asarray(run.speed)[sample]
    expected = np.abs(np.asarray(jr.unbalance_response(machine, "d.x", speeds).values)[:, 0])
    found = np.hypot(run.x, run.y)[sample]
    np.testing.assert_allclose(found, expected, atol=1e-4 * expected.max())


def test_frequency_response():
    """Receptance, mobility, accelerance of a damped oscillator; what cannot be asked."""
    m, k, c = 2.0, 1e4, 20.0
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(m, 0.02, 0.011)},
        attachments={"s": (jr.LinearSupport([k] * 3 + [50.0] * 3, [c] * 6), "d")},
        fixed={"d": ("z",)},
    )
    w = np.array([10.0, 70.0, 200.0])
    exact = 1 / (k - m * w**2 + 1j * c * w)
    for kind, power in (("receptance", 0), ("mobility", 1), ("accelerance", 2)):
        found = jr.frequency_response(machine, "d.y", ["d.y", "d.x"], w, kind=kind)
        np.testing.assert_allclose(found.values[:, 0, 0], exact * (1j * w) ** power, rtol=1e-10)
        np.testing.assert_allclose(found.values[:, 1, 0], 0, atol=1e-15)
    with pytest.raises(jr.InputError, match="`d.z`: z of `d` is held, it cannot move"):
        jr.frequency_response(machine, "d.z", "d.x", w)
    with pytest.raises(jr.InputError, match="`e.x`: no such coordinate"):
        jr.frequency_response(machine, "d.x", "e.x", w)
    peak = eqx.filter_jit(
        eqx.filter_grad(lambda m: jnp.max(jr.frequency_response(m, "d.y", "d.y", [70.0]).magnitude))
    )(machine)
    h = 1.0
    change = [abs(1 / (k + d - m * 70.0**2 + 1j * c * 70.0)) for d in (h, -h)]
    got = float(peak["s"].stiffness[1])
    assert got == pytest.approx((change[0] - change[1]) / (2 * h), rel=1e-6)


def test_campbell_follows_modes_through_crossings():
    """Torsion (constant) crosses the third forward lateral mode (rising): each keeps its line."""
    from test_shafts_with_mass import two_disc

    found = jr.campbell(two_disc(), np.linspace(0, 4000, 21) * RPM, count=7, at="undeformed")
    torsion = found.frequencies[:, found.names.index("torsional 1")]
    np.testing.assert_allclose(torsion, 650.40786626, rtol=1e-8)
    backward = found.frequencies[:, found.names.index("3 backward")]
    assert backward[0] > 650.5 > 601 > backward[-1]  # crosses torsion on its way
    assert np.all(np.diff(backward) < 0)
    np.testing.assert_allclose(found.whirl[1:, found.names.index("3 backward")], -1, atol=1e-6)
    exact = nearest(jr.critical_speeds(two_disc()), [86.4, 86.9])
    crossings = found.crossings()
    np.testing.assert_allclose(
        [crossings["1 backward"][0], crossings["1 forward"][0]], exact, rtol=1e-4
    )


def test_damped_critical_speeds():
    """Im lambda(w) = w: a Jeffcott rotor's sqrt(w0² - (c/2m)²), and its derivative by c."""
    stiffness, rest = [1e4, 1e4, 9e4, 1e5, 1e5, 0], [3.0, 1.0, 1.0, 0.0]
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(1.0, 0.01, 0.006)},
        attachments={"s": (jr.LinearSupport(stiffness, [30.0, 30.0, *rest]), "d")},
    )

    def speeds(c):
        damping = jnp.array([c, c, *rest])
        return jr.critical_speeds(machine.set({"s.damping": damping}), damped=True)[:2]

    slope, found = jax.jacfwd(lambda c: (speeds(c),) * 2, has_aux=True)(30.0)
    np.testing.assert_allclose(found, np.sqrt(1e4 - 15.0**2), rtol=1e-9)
    np.testing.assert_allclose(slope, -30.0 / 4 / np.sqrt(1e4 - 15.0**2), rtol=1e-7)


def test_critical_modes_say_what_they_are():
    """A rigid rotor on springs: tilting whirls at sqrt(k/(Jt -+ Jp)), forward and backward; the rest is told
    apart by what moves."""
    stiffness = [1e6, 1e6, 4e5, 5e3, 5e3, 1e3]
    machine = jr.Machine(
        {"d": jr.Rotor(10.0, 0.06, 0.1), "s": jr.LinearSupport(stiffness, [1.0] * 6)}, {"s": "d"}
    )
    found = jr.critical_modes(machine)
    want = [
        ("torsional 1", np.sqrt(1e3 / 0.06)),
        ("1 backward", np.sqrt(5e3 / 0.16)),
        ("axial 1", np.sqrt(4e5 / 10)),
        (None, np.sqrt(1e6 / 10)),  # both planes at once: the sense of the whirl means nothing
        (None, np.sqrt(1e6 / 10)),
        ("forward", np.sqrt(5e3 / 0.04)),
    ]
    for mode, (name, speed) in zip(found, want, strict=True):
        assert mode.frequency == pytest.approx(speed, rel=1e-9)
        assert name is None and mode.kind == "lateral" or name in mode.name
    np.testing.assert_allclose(jr.critical_speeds(machine), [m.frequency for m in found])
    assert [m.frequency for m in jr.critical_modes(machine, 2.0, count=1)] == pytest.approx(
        [np.sqrt(1e3 / 0.06)]
    )
