"""Axial force, torque and gyroscopic moments of shafts with mass: buckling loads and whirl in closed form, by
the elements' matrices alone; the books; the derivatives of a buckling load; what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.machine.condensation import paths_of
from jaxrotor.machine.lineup import structure_of

E, G, RHO, L, D = 2.11e11, 8.12e10, 7810.0, 0.8, 0.04
METAL = jr.Material(E, G, RHO)
AREA, MOMENT = np.pi * D**2 / 4, np.pi * D**4 / 64
KGA = 6 * (1 + (E / G / 2 - 1)) / (7 + 6 * (E / G / 2 - 1)) * G * AREA  # Cowper, solid
EULER = np.pi**2 * E * MOMENT / L**2
BERNOULLI = dict(shear=False, rotary_inertia=False)
PINNED, CLAMPED = ((0, 1), (0, 1)), ((0, 1, 3, 4), ())


def shaft(elements=8, **given):
    return jr.FiniteElementShaft(L, D, **(dict(material=METAL, elements=elements) | given))


def lateral(shaft, held=PINNED):
    """K, M and G (all of it, per rad/s) of the elements put together, without what is held at the first and
    the last station; x, y, psi, theta of each."""
    ((_, element, _),) = shaft.parts().connectors
    K, _ = jax.vmap(lambda e: e.matrices(), in_axes=-1, out_axes=-1)(element)
    n = K.shape[-1]
    found = []
    for X in (K, element.M, element.G):
        whole = np.zeros((6 * n + 6,) * 2)
        for k in range(n):
            whole[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += np.asarray(X[..., k])
        found.append(whole)
    K, M, G = found
    momentum = M[5::6, 5::6].sum(axis=1)  # of each station, that of its row
    for k in range(n + 1):
        G[6 * k + 3, 6 * k + 4] += momentum[k]
        G[6 * k + 4, 6 * k + 3] -= momentum[k]
    ends = {0: held[0], n: held[1]}
    keep = [6 * k + c for k in range(n + 1) for c in (0, 1, 3, 4) if c not in ends.get(k, ())]
    return tuple(X[np.ix_(keep, keep)] for X in (K, M, G))


def critical(held=PINNED, elements=8, **loads):
    """The least positive factor of unit loads at which K is singular."""
    bare, loaded = (
        lateral(shaft(elements, **BERNOULLI, **given), held)[0] for given in ({}, loads)
    )
    factors = 1 / np.linalg.eigvals(np.linalg.solve(bare, bare - loaded))
    real = factors[(abs(factors.imag) < 1e-6 * abs(factors)) & (factors.real > 0)].real
    return real.min() if real.size else np.inf


@pytest.mark.parametrize(
    "held, loads, exact, waves",
    [
        # Euler; a wave of n half turns over the length is met to (n pi h/L)^4/720
        (PINNED, dict(axial_force=-1.0), EULER, 1.0),
        (CLAMPED, dict(axial_force=-1.0), EULER / 4, 0.5),
        # Greenhill 1883; a follower at pinned ends, where no moment is left, needs as much (Ziegler 1968)
        (PINNED, dict(torque=1.0, torque_kind="axial"), 2 * np.pi * E * MOMENT / L, 2.0),
        (PINNED, dict(torque=1.0, torque_kind="follower"), 2 * np.pi * E * MOMENT / L, 2.0),
        (PINNED, dict(torque=-1.0, torque_kind="axial"), 2 * np.pi * E * MOMENT / L, 2.0),
        # semi-tangential: pi EI/L on a cantilever (Beck 1955); pinned u = e^(ikz) + a quadratic with
        # EI u'' = i T u'/2 at both ends gives tan(a) = -a/3, T = 2 a EI/L
        (CLAMPED, dict(torque=1.0), np.pi * E * MOMENT / L, 1.0),
        (
            PINNED,
            dict(torque=1.0),
            2 * brentq(lambda a: np.tan(a) + a / 3, 1.6, 3.1) * E * MOMENT / L,
            1.563,
        ),
    ],
)
def test_buckling_loads(held, loads, exact, waves):
    """From above, by the fourth power of the element's length: to a fifth of it and below 2e-5 with 16."""
    errors = np.array([critical(held, n, **loads) / exact - 1 for n in (8, 16)])
    assert np.all(errors > 0) and errors[1] < 4e-5
    np.testing.assert_allclose(errors[0] / errors[1], 16.0, rtol=0.05)
    if loads.get("axial_force"):
        np.testing.assert_allclose(
            errors, (waves * np.pi / np.array([8, 16])) ** 4 / 720, rtol=0.02
        )


@pytest.mark.parametrize("kind", ["axial", "follower"])
def test_a_cantilever_under_torque_flutters(kind):
    """No load makes it buckle, and the smallest makes it flutter (Ziegler 1968, 5.3)."""
    assert critical(CLAMPED, torque=1.0, torque_kind=kind) == np.inf
    K, M, _ = lateral(shaft(torque=100.0, torque_kind=kind, **BERNOULLI), CLAMPED)
    squares = np.linalg.eigvals(np.linalg.solve(M, K))
    assert np.max(abs(squares.imag) / abs(squares)) > 1e-5
    K, M, _ = lateral(shaft(torque=100.0, **BERNOULLI), CLAMPED)
    np.testing.assert_allclose(K, K.T, atol=1e-12 * np.max(K))


def test_thrust_and_torque_together():
    """(T/2EI)² + P/EI = (pi/L)², P pushing: Greenhill 1883; Timoshenko & Gere, Theory of Elastic Stability
    (1961), 2.21. With tension, beyond the torque alone too."""
    for share in (0.3, 0.8, -1.5):
        thrust = share * EULER
        torque = 2 * E * MOMENT * np.sqrt((np.pi / L) ** 2 - thrust / (E * MOMENT))
        given = dict(axial_force=-thrust, torque=torque, torque_kind="axial")
        K, M, _ = lateral(shaft(24, **given, **BERNOULLI))
        free, _, _ = lateral(shaft(24, **BERNOULLI))
        least = np.min(abs(np.linalg.eigvals(np.linalg.solve(free, K))))
        assert least < 2e-5
        given["torque"] = 0.97 * torque
        K, _, _ = lateral(shaft(24, **given, **BERNOULLI))
        assert np.min(np.linalg.eigvals(np.linalg.solve(M, K)).real) > 0


def test_with_shear_it_is_engessers_column():
    """P = Pe/(1 + Pe/(kappa G A)), a thousandth below Euler's here; errors by h² and h⁴ taken out of
    three meshes."""
    found = []
    for n in (8, 16, 32):
        bare, loaded = (lateral(shaft(n, axial_force=p))[0] for p in (0.0, -1.0))
        found.append(1 / np.max(np.linalg.eigvals(np.linalg.solve(bare, bare - loaded)).real))
    exact = EULER / (1 + EULER / KGA)
    assert abs(exact / EULER - 1) > 1e-3
    np.testing.assert_allclose((64 * found[2] - 20 * found[1] + found[0]) / 45, exact, rtol=5e-8)


@pytest.mark.parametrize("load", [-0.7, 0.0, 4.0])
def test_vibration_under_axial_force(load):
    """w_n = (n pi/L)² sqrt(EI/(rho A)) sqrt(1 + P/P_n), P_n = n² Euler's."""
    n = np.arange(1, 4)
    exact = (n * np.pi / L) ** 2 * np.sqrt(E * MOMENT / (RHO * AREA))
    exact = exact * np.sqrt(1 + load / n**2)
    K, M, _ = lateral(shaft(32, axial_force=load * EULER, **BERNOULLI))
    found = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:6:2])
    np.testing.assert_allclose(found, exact, rtol=1e-5)


def whirl(given, speed, held=PINNED):
    K, M, G = lateral(given, held)
    n, none = len(K), np.zeros_like(K)
    A = np.block([[none, np.eye(n)], [-np.linalg.solve(M, np.hstack([K, speed * G]))]])
    values = np.linalg.eigvals(A)
    return np.sort(values.imag[values.imag > 1.0])


def column(n, load, speed, shear, rotary, turning):
    """Whirl frequencies (rad/s, forward ones positive) of a rotating, pinned Timoshenko column with n half
    waves: u = U sin(kz), section's slope S cos(kz), both e^(iwt) in the complex plane of x + iy."""
    k = n * np.pi / L
    soft = KGA if shear else 1e5 * KGA

    def gap(w):
        a = soft * k**2 + load * k**2 - RHO * AREA * w**2
        inertia = RHO * MOMENT * (rotary * w**2 - turning * 2 * speed * w)
        b = E * MOMENT * k**2 + soft - inertia
        return a * b - (soft * k) ** 2

    roots = np.polynomial.Polynomial.fit(x := np.linspace(-1, 1, 5), gap(2e4 * x), 4).roots()
    return np.sort(2e4 * roots[abs(roots.imag) < 1e-9].real)


@pytest.mark.parametrize(
    "load, rotary, turning",
    [(-0.5, True, True), (2.0, True, True), (-0.5, True, False), (2.0, False, True)],
)
def test_a_rotating_column(load, rotary, turning):
    """Forward and backward whirl of the first two waves at 2000 rad/s against the closed form, with
    gyroscopic moments and rotary inertia together and each without the other; errors by h² and h⁴ taken out
    of three meshes."""
    speed, found = 2000.0, []
    exact = np.concatenate([column(n, load * EULER, speed, True, rotary, turning) for n in (1, 2)])
    exact = np.sort(abs(exact[abs(exact) < 8e3]))
    assert len(exact) == 4
    split = exact[1] / exact[0] - 1
    assert split > 2e-3 if turning else split < 1e-9
    for n in (8, 16, 32):
        options = dict(rotary_inertia=rotary, gyroscopic=turning, axial_force=load * EULER)
        found.append(whirl(shaft(n, **options), speed)[:4])
    left = (64 * found[2] - 20 * found[1] + found[0]) / 45
    np.testing.assert_allclose(left, exact, rtol=2e-7)


def test_each_section_has_its_loads():
    """Two sections with their own loads are two shafts with a node between."""

    def stiffness(element, k):
        return jax.tree.map(lambda x: x[..., k], element).matrices()[0]

    both = dict(axial_force=[1e5, -2e4], torque=[300.0, 50.0], material=METAL, elements=2)
    ((_, whole, _),) = jr.FiniteElementShaft([0.3, 0.5], [0.04, 0.03], **both).parts().connectors
    for k, (length, d) in enumerate([(0.3, 0.04), (0.5, 0.03)]):
        given = {name: both[name][k] for name in ("axial_force", "torque")}
        one = jr.FiniteElementShaft(length, d, material=METAL, elements=2, **given)
        ((_, part, _),) = one.parts().connectors
        for j in range(2):
            K = [stiffness(whole, 2 * k + j), stiffness(part, j)]
            np.testing.assert_allclose(K[0], K[1], rtol=1e-12)


def loaded(kind="semi-tangential", **given):
    """A disc between two shafts that carry a thrust and a torque, pinned at the ends."""
    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "one": shaft(2, axial_force=-1e5, torque=2e4, torque_kind=kind, **given),
            "disc": jr.Rotor(20.0, 0.3, 0.17, unbalance=jr.Unbalance(1e-4, inclination=1e-3)),
            "two": shaft(2, axial_force=3e4, gyroscopic=False, **given),
            "right": jr.Node(),
        },
        fixed={"left": ("x", "y", "z"), "right": ("x", "y")},
        gravity=(0.0, -9.81, 0.0),
    )


def test_the_books_close():
    """Free to spin, with damping: the potential of the loads, the work of an axial moment on the tilts, and
    gyroscopic moments left out."""
    machine = loaded("axial", rayleigh=(1.0, 1e-6))
    audit = jr.energy_audit(machine, 0.02, 2000.0, initial="undeformed", speed=200.0, step=1e-5)
    assert float(audit.relative) < 1e-7
    # the moment's own work is seen in them
    assert float(jnp.ptp(audit.work_in)) > 1e-3 * float(jnp.ptp(audit.elastic))


def test_derivatives_of_a_buckling_factor():
    """Forward, reverse, differences, by force, torque, length and a diameter; and the numbers' own way."""
    machine = loaded()
    paths = ["one.axial_force", "one.torque", "one.length", "two.diameter"]
    start = [-1e5, 2e4, 0.8, 0.04]

    def factor(x):
        return jr.linear.buckling_factor(machine.set(dict(zip(paths, x))))[None]

    slopes = assert_derivatives_agree(factor, start, rtol=1e-6)
    # more thrust, and more torque, buckle it sooner; a longer shaft too; a stiffer neighbour later
    assert np.all(np.sign(slopes[0]) == [1, -1, -1, 1])
    found, more = (
        float(jr.linear.buckling_factor(m)) for m in (machine, machine.set({paths[0]: -1.001e5}))
    )
    assert (more - found) / -100 == pytest.approx(slopes[0][0], rel=2e-3)
    # what `two` carries stays where `one` alone grows, so that its tension holds longer
    assert float(jr.linear.buckling_factor(machine, shafts="one")) != pytest.approx(found, rel=1e-3)


def test_past_buckling_it_is_said():
    """Modes and critical speeds are of what swings; that the machine leaves its position is no mode."""
    machine = loaded()
    factor = float(jr.linear.buckling_factor(machine))
    paths = ("one.axial_force", "one.torque", "two.axial_force")
    for share, told in ((0.99, False), (1.01, True)):
        own = machine.set({path: share * factor * machine.get(path) for path in paths})
        model = jr.linear.linearize(own)
        assert (float(model.growth) > 1.0) == told
        for call in (lambda: jr.linear.modes(model, 3), lambda: jr.linear.critical_speeds(own)):  # noqa: B023
            if told:
                with pytest.warns(UserWarning, match="leaves its position .* it has buckled"):
                    call()
            else:
                call()  # a warning is an error here


def test_a_shaft_with_torque_keeps_its_stations():
    """Planes that push each other are not condensed apart; an axial force is as any stiffness."""
    machine = loaded()
    names = machine.wiring.stations
    followed = [names[k] for path in paths_of(structure_of(machine)) for k in path]
    assert followed == ["two.1"]


@pytest.mark.parametrize(
    "call, sentence",
    [
        (lambda m: jr.linear.buckling_factor(m, shafts=["disc"]), "`disc`: carries neither"),
        (
            lambda m: jr.linear.buckling_factor(m.set({"one.torque": 0.0, "one.axial_force": 1.0})),
            "no factor of these loads makes the machine buckle",
        ),
        (
            lambda m: jr.linear.buckling_factor(
                m.set({"one.torque": 0.0, "one.axial_force": 0.0, "two.axial_force": 0.0})
            ),
            "`one.axial_force`: is zero, as all loads",
        ),
        (
            lambda m: jr.linear.buckling_factor(
                jr.Machine.in_line({"a": jr.Node(), "s": shaft(2), "b": jr.Node()})
            ),
            "no shaft carries a load: give axial_force or torque",
        ),
        (
            lambda m: jr.linear.buckling_factor(
                jr.Machine.in_line(
                    {"a": jr.Node(), "s": shaft(2, axial_force=-1.0), "b": jr.Node()}
                )
            ),
            "is not held sideways: nothing resists its loads; add supports",
        ),
        (lambda m: shaft(torque_kind="conservative"), "torque_kind must be"),
        (
            lambda m: jr.Machine.in_line(
                {
                    "a": jr.Node(),
                    "s": shaft(2, torque=[1.0, 2.0, 3.0], axial_force=[1.0, 2.0]),
                    "b": jr.Node(),
                }  # fmt: skip
            ),
            "`s`: what is given for each section .* axial_force has 2 entries where another has 3",
        ),
    ],
)
def test_what_is_refused(call, sentence):
    with pytest.raises(jr.InputError, match=sentence):
        call(loaded())


def test_stations_follow_in_a_shaft_under_axial_force():
    """Natural frequencies of the reduced machine to what it says of itself; a run of stations that buckles
    between its ends cannot follow them, and stays."""
    machine = jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft": shaft(20, axial_force=-0.3 * EULER),
            "disc": jr.Rotor(10.0, 0.1, 0.06),
        },
        fixed={"left": ("x", "y", "z", "psi", "theta")},
    )
    reduced = machine.reduced(up_to=500.0, speed=300.0)
    error = reduced.wiring.condensation.error
    assert 0 < error < 1e-6 and reduced.wiring.condensation.spans
    found, full = (
        jr.linearize(m, 300.0, at="undeformed").natural_frequencies[:4]
        for m in (reduced, machine.full())
    )
    np.testing.assert_allclose(found, full, rtol=error + 1e-9)
    bare = jr.linearize(
        machine.set({"shaft.axial_force": 0.0}).full(), 300.0, at="undeformed"
    ).natural_frequencies
    assert float(bare[0] / full[0]) > 1.1
    pressed = machine.set({"shaft.axial_force": -5 * EULER})
    assert not pressed.reduced(up_to=500.0, speed=300.0).wiring.condensation.spans
