"""Labyrinth seals: leakage, pressures and swirl against roots found another way and balances; coefficients
against the nonlinear flow around a whirling rotor and another program; inside machines."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.linear.linearise import models_over_speed

NAMES = (
    "diameter clearance pitch height inlet_pressure outlet_pressure temperature gas_constant viscosity "
    "heat_ratio preswirl tooth_width"
).split()
# five teeth, nearly at Mach 1 in the last; a case of carbon dioxide
VALUES = np.array([0.2, 3e-4, 4e-3, 3.5e-3, 6e5, 3.5e5, 320.0, 188.9, 1.6e-5, 1.29, 0.6, 2e-4])
GIVEN = dict(zip(NAMES, VALUES))
SPEED = 900.0


def four(point):
    """K, k, C, c."""
    for x in (point.stiffness, point.damping):
        assert x[0, 0] == x[1, 1] and x[0, 1] == -x[1, 0]
    return np.array([x[0, j] for x in (point.stiffness, point.damping) for j in (0, 1)])


def labyrinth(on: Any = "stator", teeth: Any = 5, **change):
    return jr.elements.LabyrinthSeal(**GIVEN | change, teeth=teeth, on=on)


# The seal of ROSS's own tests (air at 3 bar, interlocking, 16 teeth, 8000 rpm).
ROSS_SEAL = dict(
    diameter=0.145,
    clearance=3e-4,
    pitch=3.175e-3,
    height=3.175e-3,
    inlet_pressure=308000.0,
    temperature=283.15,
    gas_constant=8314 / 28.96807,
    viscosity=1.7746561138374613e-05,
    teeth=16,
    on="both",
    flow_coefficient=0.6538207763479065,  # what its polynomial of the teeth's width gives
)
ROSS_SPEED = 8000 * np.pi / 30


# --- the flow, written down again


def tooth_flow(before, behind, gap, carry, RT, g):
    """kg/s per metre: Neumann's with Chaplygin's coefficient, at most St. Venant's at the critical ratio."""
    critical = ((g + 1) / 2) ** (g / (g - 1))

    def chaplygin(ratio):
        s = ratio ** ((g - 1) / g) - 1
        return np.pi / (np.pi + 2 - 5 * s + 2 * s**2)

    free = chaplygin(np.minimum(before / behind, critical)) * np.sqrt(before**2 - behind**2)
    throat = 2 * g / (g - 1) * (critical ** (-2 / g) - critical ** (-(g + 1) / g))
    return carry * gap / np.sqrt(RT) * np.minimum(free, chaplygin(critical) * throat**0.5 * before)


def carries(given, teeth, on="stator"):
    if on == "both":
        return np.ones(teeth)
    room = (given["pitch"] - given["tooth_width"]) / given["clearance"]
    return np.r_[1.0, np.full(teeth - 1, (1 - 8.52 / (room + 7.23)) ** -0.5)]


def pressures_by_hand(given, teeth, on="stator"):
    """From the outlet on, tooth by tooth: of each flow there is one pressure before the first."""
    RT, g = given["gas_constant"] * given["temperature"], given["heat_ratio"]
    carry = carries(given, teeth, on)

    def back(flow):
        found = [given["outlet_pressure"]]
        for c in carry[::-1]:

            def lacks(p, end=found[-1], c=c):
                return tooth_flow(p, end, given["clearance"], c, RT, g) - flow

            found.append(brentq(lacks, found[-1], 1e3 * given["inlet_pressure"], xtol=1e-9))
        return np.array(found[::-1])

    most = given["clearance"] * given["inlet_pressure"] / RT**0.5
    flow: Any = brentq(
        lambda m: back(m)[0] - given["inlet_pressure"], 1e-6 * most, most, xtol=1e-15
    )
    return flow, back(flow)[1:-1]


@pytest.mark.parametrize("outlet", [5.9e5, 3.5e5, 1e5, 1e3])
def test_leakage_and_pressures(outlet):
    found = labyrinth(outlet_pressure=outlet).coefficients(SPEED)
    flow, pressures = pressures_by_hand(GIVEN | dict(outlet_pressure=outlet), 5)
    assert float(found.leakage) == pytest.approx(np.pi * 0.2 * flow, rel=1e-10)
    np.testing.assert_allclose(found.pressures, pressures, rtol=1e-10)


def test_mach_1_at_the_last_tooth():
    """Then the pressure behind it counts no more; Fliegner's 0.510 of air is what passes it."""
    given = dict(heat_ratio=1.4)
    low, lower = (labyrinth(**given, outlet_pressure=p).coefficients(0.0) for p in (1e5, 1e3))
    assert float(low.leakage) == float(lower.leakage)
    np.testing.assert_array_equal(low.pressures, lower.pressures)
    last = carries(GIVEN, 5)[-1] * 3e-4 * float(low.pressures[-1]) / (188.9 * 320.0) ** 0.5
    assert float(low.leakage) / (np.pi * 0.2 * last) == pytest.approx(0.510, abs=7e-4)
    higher = labyrinth(**given, outlet_pressure=4e5).coefficients(0.0)
    assert float(higher.leakage) < 0.98 * float(low.leakage)


def test_leakage_in_closed_form():
    """With one coefficient and no carry-over the squares of the pressures fall in equal steps (Martin,
    without his logarithm)."""
    given = ROSS_SEAL | dict(outlet_pressure=200000.0, flow_coefficient=0.7, heat_ratio=1.4)
    found = jr.elements.LabyrinthSeal(**given, whirl=ROSS_SPEED).coefficients(ROSS_SPEED)
    squares = np.linspace(308000.0**2, 200000.0**2, 17)
    np.testing.assert_allclose(found.pressures, squares[1:-1] ** 0.5, rtol=1e-12)
    RT = 8314 / 28.96807 * 283.15
    flow = 0.7 * 3e-4 * ((308000.0**2 - 200000.0**2) / 16 / RT) ** 0.5
    assert float(found.leakage) == pytest.approx(np.pi * 0.145 * flow, rel=1e-12)


def walls(on):
    """Lengths of the rotor's and the stator's walls of a chamber over its own."""
    side = GIVEN["height"] / GIVEN["pitch"]
    return {
        "stator": (1, 1 + 2 * side),
        "rotor": (1 + 2 * side, 1),
        "both": (1 + side, 1 + side),
    }[on]


def shear(U, density, D):
    return density * U * abs(U) / 2 * 0.079 * (density * abs(U) * D / GIVEN["viscosity"]) ** -0.25


def swirl_by_hand(on, speed, flow, pressures):
    """Chamber by chamber."""
    RT, (rotor, stator) = GIVEN["gas_constant"] * GIVEN["temperature"], walls(on)
    B, L = GIVEN["height"] + GIVEN["clearance"], GIVEN["pitch"]
    surface, found = 0.1 * speed, [GIVEN["preswirl"] * 0.1 * speed]
    for p in pressures:

        def gains(V, p=p):
            drags = rotor * shear(surface - V, p / RT, 2 * B * L / (B + L))
            drags -= stator * shear(V, p / RT, 2 * B * L / (B + L))
            return flow * (V - found[-1]) - L * drags

        found.append(brentq(gains, -1e3, 1e3, xtol=1e-13))
    return np.array(found[1:])


@pytest.mark.parametrize("on", ["stator", "rotor", "both"])
def test_swirl(on):
    # (a program fewer: the swirl knows no whirl)
    found = labyrinth(on, whirl=400.0 if on == "rotor" else None).coefficients(SPEED)
    flow = float(found.leakage) / (np.pi * 0.2)
    by_hand = swirl_by_hand(on, SPEED, flow, np.asarray(found.pressures))
    np.testing.assert_allclose(found.swirl, by_hand, rtol=1e-5)


def test_swirl_settles_where_both_walls_pull_alike():
    """Where next to nothing comes through: of walls alike at half the rotor's speed, else by the 4/7th power
    of their lengths."""
    for on in ("stator", "both"):
        last = labyrinth(on, clearance=1e-7).coefficients(SPEED).swirl[-1] / (0.1 * SPEED)
        rotor, stator = walls(on)
        assert float(last) == pytest.approx(1 / (1 + (stator / rotor) ** (4 / 7)), rel=1e-4)


# --- coefficients


def whirling_flow(on, speed, whirls, share=1e-4, columns=8):
    """-F/r of a rotor in circular whirls of a small amplitude, by the NONLINEAR balances of mass and momentum
    in the chambers: waves around the seal, in axes that whirl along; Newton's method by differences."""
    teeth, C, L, R = 5, GIVEN["clearance"], GIVEN["pitch"], 0.1
    RT, carry, (rotor, stator) = GIVEN["gas_constant"] * 320.0, carries(GIVEN, 5, on), walls(on)
    flow, pressures = pressures_by_hand(GIVEN, teeth, on)
    theta = 2 * np.pi * np.arange(columns) / columns
    h = C - share * C * np.cos(theta)
    area = (GIVEN["height"] + h) * L
    D = 2 * area / (GIVEN["height"] + h + L)
    waves = np.fft.fftfreq(columns, 1 / columns) * (np.arange(columns) != columns // 2)
    entry = np.full((1, columns), GIVEN["preswirl"] * R * speed)

    def around(f):
        return np.fft.ifft(1j * waves * np.fft.fft(f, axis=-1), axis=-1).real

    def residual(x, whirl):
        P, V = x.reshape(2, teeth - 1, columns) * np.array([1e5, 100.0])[:, None, None]
        ends = np.ones((1, columns)) * GIVEN["inlet_pressure"], np.ones((1, columns)) * 3.5e5
        P_all = np.concatenate([ends[0], P, ends[1]])
        m = tooth_flow(P_all[:-1], P_all[1:], h, carry[:, None], RT, GIVEN["heat_ratio"])
        carried = (V / R - whirl) * P / RT * area
        pulled = L * (rotor * shear(R * speed - V, P / RT, D) - stator * shear(V, P / RT, D))
        mass = around(carried) + m[1:] - m[:-1]
        through = m[1:] * V - m[:-1] * np.concatenate([entry, V[:-1]])
        momentum = around(carried * V) + through + area / R * around(P) - pulled
        return np.concatenate([mass.ravel(), momentum.ravel() / 100.0]) / flow

    start = np.stack([pressures / 1e5, swirl_by_hand(on, speed, flow, pressures) / 100.0])
    start, found = np.repeat(start[:, :, None], columns, 2).ravel(), []
    for whirl in whirls:
        steps = 1e-6 * np.eye(start.size)
        slope = [(residual(start + d, whirl) - residual(start - d, whirl)) / 2e-6 for d in steps]
        inverse, x = np.linalg.inv(np.array(slope).T), start
        for _ in range(8):
            x = x - inverse @ residual(x, whirl)
        assert np.abs(residual(x, whirl)).max() < 1e-12
        p = 1e5 * x.reshape(2, teeth - 1, columns)[0]
        found.append(2 * np.pi * R * L * np.sum(np.mean(p * np.exp(1j * theta), 1)) / (share * C))
    return np.array(found)


@pytest.mark.parametrize("on, whirl", [("stator", None), ("rotor", 400.0), ("both", None)])
def test_coefficients_by_the_nonlinear_flow(on, whirl):
    """Of whirls with and against the turning; synchronous, or at a frequency given."""
    f = SPEED if whirl is None else whirl
    ahead, back = whirling_flow(on, SPEED, (f, -f))
    mean, odd = (ahead + back) / 2, (ahead - back) / (2 * f)
    expected = np.array([mean.real, -mean.imag, odd.imag, odd.real])
    found = four(labyrinth(on, whirl=whirl).coefficients(SPEED))
    np.testing.assert_allclose(found, expected, rtol=2e-6)


def beside_ross(point):
    """K, k, C, c, leakage (its radius is that of the middle of the clearance), swirl at both ends."""
    leakage = float(point.leakage) * (0.0725 + 1.5e-4) / 0.0725
    return [*four(point), leakage, float(point.swirl[0]), float(point.swirl[-1])]


def test_another_program():
    """ROSS 3.1 with gamma = 1.0001, so that its gas stays at one temperature: its teeth are nozzles, which
    Neumann's are to the first order of a fall of 0.8 % each. Both ways of a whirl at half the speed too."""
    given = ROSS_SEAL | dict(outlet_pressure=270000.0, heat_ratio=1.0001)
    synchronous = jr.elements.LabyrinthSeal(**given, preswirl=0.98, whirl=ROSS_SPEED)
    slower = jr.elements.LabyrinthSeal(**given, preswirl=0.3, whirl=0.5 * ROSS_SPEED)
    for seal, expected in (
        (synchronous, (-49869.705, 26577.946, 24.704967, 51.314800, 0.01158932, 52.4399, 30.8611)),
        (slower, (-17305.560, 2791.900, 18.343603, 41.355271, 0.01158932, 21.2067, 30.1653)),
    ):
        found = beside_ross(seal.coefficients(ROSS_SPEED))
        np.testing.assert_allclose(found, expected, rtol=6e-3)
        np.testing.assert_allclose(found[:4:2], expected[:4:2], rtol=2e-3)


def test_another_programs_own_case():
    """What ROSS 3.1's tests hold it to: the gas cools along the seal there, to 201 K at the outlet, and a
    fifth of the pressure falls at the last tooth."""
    given = ROSS_SEAL | dict(outlet_pressure=94300.0, heat_ratio=1.41, preswirl=0.98)
    seal = jr.elements.LabyrinthSeal(**given, whirl=ROSS_SPEED)
    expected = (-50456.588, 35541.607, 23.825112, 56.255683, 0.023719117)
    found = beside_ross(seal.coefficients(ROSS_SPEED))[:5]
    np.testing.assert_allclose(found, expected, rtol=0.1)


def test_rest_without_swirl_has_no_cross_coupling():
    """And turned the other way the seal is seen in a mirror."""
    K, k, C, c = four(labyrinth(preswirl=0.0).coefficients(0.0))
    assert C > 0 and abs(k) < 1e-9 * abs(K) and abs(c) < 1e-9 * C
    ahead, back = (four(labyrinth().coefficients(x)) for x in (SPEED, -SPEED))
    np.testing.assert_allclose(back, ahead * np.array([1, -1, 1, -1]), rtol=1e-12)
    assert ahead[1] > 0  # the swirl drives the forward whirl


def test_slopes():
    """By each parameter and the speed: forward, reverse, central differences. At rest they are finite too."""

    def value(x):
        given = dict(zip(NAMES, VALUES * (1 + x[:12])))
        found = jr.elements.LabyrinthSeal(**given, teeth=5).coefficients(SPEED * (1 + x[12]))
        parts = [found.stiffness / 1e5, found.damping / 1e2, found.leakage, found.swirl / 1e2]
        return sum(jnp.sum((1.0 + jnp.arange(p.size)) * p.ravel()) for p in map(jnp.asarray, parts))

    start, h = jnp.zeros(13), 1e-4

    @quickly_compiled
    def both(x, along):
        return jax.jvp(value, (x,), (along,)), jax.grad(value)(x)

    def at(x):
        return both(x, start)[0][0]

    reverse = both(start, start)[1]
    forward = [both(start, e)[0][1] for e in np.eye(13)]
    central = [
        (8 * (at(h * e) - at(-h * e)) - at(2 * h * e) + at(-2 * h * e)) / (12 * h)
        for e in np.eye(13)
    ]
    assert np.all(np.abs(np.asarray(central)) > 1e-4)
    np.testing.assert_allclose(forward, central, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(forward, reverse, rtol=1e-9, atol=1e-11)
    assert np.all(np.isfinite(both(start.at[12].set(-1.0).at[10].set(-1.0), start)[1]))


# --- in machines


def on_a_disc(seal):
    """A disc that nothing else holds, so that little is compiled."""
    disc = jr.Rotor(100.0, 1.0, 0.6, jr.Unbalance(1e-5, 0.0))
    return jr.Machine({"disc": disc, "seal": seal}, {"seal": "disc"})


@quickly_compiled
def curve_and_leakage(seal):
    still = (jnp.zeros(6), jnp.zeros(6))
    return seal.prepared(), seal.leakage(jnp.zeros(()), (still,), None)


@pytest.mark.parametrize(
    "change", [{}, dict(inlet_pressure=3.6e5), dict(diameter=0.6, preswirl=-1)]
)
def test_curves(change):
    """What acts within a solve, by the force on a rotor that whirls with its speed: near rest, where it goes
    with a broken power of the speed; in between; backward. Finite at speeds that nobody runs at.
    A run tells the leakage."""
    seal = labyrinth(**change)
    curve, leakage = curve_and_leakage(seal)
    assert float(leakage) == float(seal.coefficients(SPEED).leakage)
    assert np.all(np.isfinite(curve.table))
    for speed, off in ((1e-3, 2e-3), (0.7, 2e-3), (20.0, 1e-6), (SPEED, 1e-5), (-2000.0, 2e-5)):
        K, k, C, c = expected = four(seal.coefficients(speed))
        found = np.array(curve.at(jnp.asarray(speed))[:4])
        sizes = np.array([1, 1, abs(speed), abs(speed)])
        force = np.abs(expected * sizes).max()
        np.testing.assert_allclose(found * sizes, expected * sizes, rtol=0, atol=off * force)


def test_diagrams_take_the_seal_at_each_speed():
    """Taken apart from the machine, exactly; and `support` has the same in its rows, over the whirl too."""
    seal = labyrinth("rotor", whirl=200.0)
    speeds = np.linspace(100.0, 1000.0, 9)
    found = models_over_speed(on_a_disc(seal), speeds, "undeformed")(speeds[1])
    table, over_both = seal.support(speeds), seal.support(speeds, [50.0, 400.0])
    own, slower = (x.coefficients(speeds[1]) for x in (seal, labyrinth("rotor", whirl=400.0)))

    def in_six(pair):
        return np.pad(np.asarray(pair), (0, 4))

    for name in ("stiffness", "damping"):
        row, cell = getattr(table, name)[1], getattr(over_both, name)[1, 1]
        np.testing.assert_allclose(row, in_six(getattr(own, name)), rtol=1e-12)
        np.testing.assert_allclose(cell, in_six(getattr(slower, name)), rtol=1e-12)
    # the disc by hand: 100 kg, 0.6 and 1 kg m2
    np.testing.assert_allclose(found.M, np.diag([100.0] * 3 + [0.6, 0.6, 1.0]), rtol=1e-12)
    np.testing.assert_allclose(found.K, in_six(own.stiffness), rtol=1e-10, atol=1e-6)
    turning = in_six(own.damping)
    turning[3, 4] = 1.0 * speeds[1]
    turning[4, 3] = -turning[3, 4]
    np.testing.assert_allclose(found.C + found.G, turning, rtol=1e-10, atol=1e-9)


def test_books_close():
    """In a run its work is a load's."""
    # far out (the law is linear), or the work were lost in the rounding of 405 kJ of spin
    start = jr.State(np.array([[1e-2, 1e-2, 0, 0, 0, 0]]), np.array([[0.0] * 5 + [SPEED]]))
    audit = jr.energy_audit(
        on_a_disc(labyrinth("rotor", whirl=200.0)), 0.02, 2000.0, start, step=1e-4
    )
    assert float(audit.relative) < 1e-7


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(clearance=0.02), "clearance must be far smaller"),
        (dict(outlet_pressure=6e5), "inlet_pressure must be above outlet_pressure"),
        (dict(heat_ratio=0.9), "heat_ratio must be above 1"),
        (dict(flow_coefficient=1.2), "flow_coefficient must be at most 1"),
        (dict(carry_over=0.9), "carry_over must be at least 1"),
        (dict(carry_over=1.1, on="both"), "carry_over must be left out where teeth are on both"),
        (dict(pitch=9e-4), "pitch must be larger than tooth_width by three clearances"),
    ],
)
def test_impossible_seals_are_refused(change, words):
    seal = labyrinth(**change)
    with pytest.raises(jr.InputError, match="`seal`: .*" + words):
        on_a_disc(seal)
    for ask in (lambda: seal.coefficients(100.0), lambda: seal.support([0.0, 100.0])):
        with pytest.raises(jr.InputError, match="`LabyrinthSeal`: .*" + words):  # nor by themselves
            ask()


def test_a_place_of_no_teeth_is_refused():
    with pytest.raises(jr.InputError, match="on must be 'stator' or 'rotor' or 'both'"):
        labyrinth("shaft")


@pytest.mark.parametrize("rows", [[300.0], [300.0, 100.0], [-100.0, 100.0], [100.0, np.nan]])
def test_speeds_that_no_table_has_are_refused(rows):
    with pytest.raises(jr.InputError, match="speeds must be"):
        labyrinth().support(rows)
    with pytest.raises(jr.InputError, match="frequencies must be"):
        labyrinth().support([100.0, 300.0], rows)


def test_a_speed_must_be_a_number():
    with pytest.raises(jr.InputError, match="speed must be finite, but is nan rad/s"):
        labyrinth().coefficients(np.nan)
