"""The numbers that decide: worked values of the standards' formulas, closed forms of a Jeffcott rotor,
another program's response, and derivatives against central differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor import standards as st
from jaxrotor.elements import PD, ActiveTorque, Actuator

RPM = np.pi / 30
AT = "undeformed"
K, C = 1e4, 20.0


def jeffcott(k=K, c=C):
    """A disc of 1 kg on springs alike in x and y: each plane has one degree of freedom."""
    k6 = jnp.array([1.0, 1, 0, 0, 0, 0]) * k + jnp.array([0, 0, 1e6, 1e6, 1e6, 0])
    support = jr.LinearSupport(k6, jnp.array([1.0, 1, 0, 0, 0, 0]) * c)
    disc = jr.Rotor(1.0, 0.02, 0.0101, unbalance=jr.Unbalance(1e-5, 0.4))
    return jr.Machine({"disc": disc, "s": support}, {"s": "disc"})


@pytest.fixture(scope="module")
def disc():
    return jeffcott(c=10.0)


# Formulas


@pytest.mark.parametrize(
    "factor, below, above",
    [
        (2.5, 0.0, 10.0),
        (3.55, 8.707, 18.707),
        (5.0, 12.143, 22.143),
        (8.0, 14.385, 24.385),
        (12.4, 15.440, 25.440),
        (2.4999, 0.0, 0.0),
        (1e6, 16.0, 26.0),  # the caps
    ],
)
def test_required_margins(factor, below, above):
    np.testing.assert_allclose(st.required_margins(factor), [below, above], atol=5e-4)


def test_actual_margin():
    """In parts of the running speed: 14 000 below 20 000 has 30 %, 26 000 above it too; between, negative."""
    assert st.actual_margin(14000.0, 20000.0, 22000.0) == pytest.approx(30.0)
    assert st.actual_margin(26000.0, 15000.0, 20000.0) == pytest.approx(30.0)
    assert st.actual_margin(16000.0, 15000.0, 20000.0) == pytest.approx(-100 / 15)


def test_unbalance_and_probe_limit():
    assert 2e6 * st.residual_unbalance_of_api(100.0, 9000 * RPM) == pytest.approx(141.111, abs=5e-4)
    # from 25 000 rpm on 0.254 µm
    assert 1e6 * st.residual_unbalance_of_api(10.0, 40000 * RPM) == pytest.approx(2.54)
    assert 1e6 * st.probe_limit(15000 * RPM) == pytest.approx(22.7185, abs=5e-5)
    assert 1e6 * st.probe_limit(25000 * RPM) == pytest.approx(17.5976, abs=5e-5)
    assert 1e6 * st.probe_limit(9000 * RPM) == pytest.approx(25.4)
    assert st.scale_factor(25.4e-6, 2e-6) == 6.0
    assert st.scale_factor(25.4e-6, 12.7e-6) == pytest.approx(2.0)


def test_anticipated_cross_coupling():
    found = st.anticipated_cross_coupling(1e6, 10000 * RPM, 0.5, 0.02, 1.5)
    assert found == pytest.approx(4.2972e5, rel=2e-5)


def test_balance_grade_and_planes():
    whole = st.permissible_unbalance(100.0, 3000 * RPM, 2.5)
    assert 1e6 * whole == pytest.approx(795.775, abs=5e-4)
    np.testing.assert_allclose(st.in_two_planes(whole, (0.0, 1.0), 0.25) / whole, [0.75, 0.25])
    with pytest.raises(jr.InputError, match="outside the planes"):
        st.in_two_planes(whole, (0.0, 1.0), 1.25)
    found = st.residual_unbalance([3e-4, 5e-4], 100.0, 3000 * RPM, planes=(0.0, 1.0), centre=0.25)
    assert [bool(f.met) for f in found.findings] == [True, False]
    assert found.findings[1].limit == pytest.approx(198.944, abs=5e-4)


def test_corrections_in_holes():
    """Two holes give the vector exactly; pieces leave the least of all combinations."""
    angles, radius, wanted = np.arange(8) * np.pi / 4, 0.1, 1e-4 * np.exp(0.3j)
    found = st.split_correction(wanted, angles, radius)
    masses = np.asarray(found.masses)
    assert np.count_nonzero(masses) == 2 and np.all(masses >= 0)
    assert np.sum(masses * radius * np.exp(1j * angles)) == pytest.approx(wanted, rel=1e-12)
    on_one = st.split_correction(1e-4, angles, radius)
    np.testing.assert_allclose(on_one.masses, [1e-3, *[0.0] * 7], atol=1e-15)
    with pytest.raises(jr.InputError, match="no two holes"):
        st.split_correction(-1e-4, [0.0, 1.0], radius)
    pieces = [1e-4, 2e-4, 5e-4, 1e-3]
    filled = st.fill_holes(wanted, angles, radius, pieces, 2)
    least = min(
        abs(wanted - radius * (a * np.exp(1j * x) + b * np.exp(1j * y)))
        for i, x in enumerate(angles)
        for y in angles[i + 1 :]
        for a in (0.0, *pieces)
        for b in (0.0, *pieces)
    )
    assert abs(complex(filled.left)) == pytest.approx(least, rel=1e-9)
    back = np.sum(np.asarray(filled.masses) * radius * np.exp(1j * angles))
    assert back + complex(filled.left) == pytest.approx(wanted)


def test_vibration_zones():
    np.testing.assert_allclose(1e6 * st.shaft_zone_limits(3600 * RPM), [80.0, 150.0, 220.0])
    (found,) = st.shaft_vibration(1e-4, 3600 * RPM).findings
    assert "zone B" in found.place and found.met
    assert not st.shaft_vibration(1.6e-4, 3600 * RPM).met
    assert st.shaft_vibration(1.6e-4, 3600 * RPM, "C").met
    np.testing.assert_allclose(1e3 * st.housing_zone_limits("1", "rigid"), [2.3, 4.5, 7.1])
    assert "zone D" in st.housing_vibration(8e-3).findings[0].place


# Amplification and margins


def test_a_jeffcott_rotors_amplification(disc):
    """Peak, flanks and factor in closed form: u²/((1-u)² + 4 z² u) of the squared speed ratio u."""
    z = 0.05
    found = st.resonances(disc, "disc.x", 20.0, 300.0, {"disc": 1e-5}, at=AT)
    peak2 = 1 / (4 * z**2 * (1 - z**2))
    flanks = 100 * np.sqrt(np.sort(np.roots([1 - 2 / peak2, -(2 - 4 * z**2), 1.0])))
    assert found.speeds[0] == pytest.approx(100 / np.sqrt(1 - 2 * z**2), rel=1e-10)
    np.testing.assert_allclose([found.low[0], found.high[0]], flanks, rtol=1e-12)
    assert found.amplitudes[0] == pytest.approx(1e-5 * np.sqrt(peak2), rel=1e-12)
    assert found.factors[0] == pytest.approx(float(found.speeds[0]) / np.ptp(flanks), rel=1e-9)
    # the same under jit, and by any direction of an orbit that is a circle
    jitted = jax.jit(
        lambda m: st.resonances(m, "disc", 20.0, 300.0, {"disc": 1e-5}, count=2, at=AT).factors
    )(disc)
    assert jitted[0] == pytest.approx(float(found.factors[0]), rel=1e-7) and np.isnan(jitted[1])


def test_its_own_unbalance_and_a_placed_one(disc):
    """As `unbalance_response` has it, from the vector field: static and dynamic, magnitude and phase."""
    leaning = disc.set(
        {"disc.unbalance.inclination": 1e-3, "disc.unbalance.inclination_angle": 0.9}
    )
    outputs = ["disc.x", "disc.y", "disc.theta", "disc.psi"]
    theirs = np.asarray(jr.unbalance_response(leaning, outputs, [60.0, 140.0], at=AT).values)
    own = st.placed_response(leaning, None, outputs, [60.0, 140.0], at=AT)
    # the vector field is not linear in the unbalance: what is left goes with its square
    np.testing.assert_allclose(np.asarray(own.values), theirs, rtol=1e-5)
    placed = st.placed_response(disc, {"disc": (1e-5, 0.4)}, outputs[:2], [60.0], at=AT)
    np.testing.assert_allclose(
        np.asarray(placed.values), jr.unbalance_response(disc, outputs[:2], [60.0], at=AT).values,
        rtol=1e-9,
    )  # fmt: skip


def test_one_flank_where_the_range_ends(disc):
    found = st.resonances(disc, "disc.x", 20.0, 102.0, {"disc": 1e-5}, at=AT)
    assert np.isnan(found.high[0]) and "no flank above" in found.sides(0)
    assert found.factors[0] == pytest.approx(
        float(found.speeds[0] / (2 * (found.speeds[0] - found.low[0])))
    )
    assert "no flank above" in repr(st.amplification_factors(found))


def test_margins_are_met_or_not(disc):
    """AF 9.9 at 957.3 rpm: 15.0 % below, 25.0 % above, never between."""

    def margin(least, greatest, **more):
        check = st.separation_margins(
            disc, "disc.x", least, greatest, {"disc": 1e-5}, start=20.0, stop=300.0, at=AT, **more
        )
        return [f for f in check.assessment.findings if f.check == "separation margin"][0]

    critical, factor = 100 / np.sqrt(1 - 2 * 0.05**2), 9.8996221
    part = 17 * (1 - 1 / (factor - 1.5))
    far, near = margin(120.0, 150.0), margin(115.0, 150.0)
    assert far.met and not near.met
    assert far.limit == pytest.approx(part, rel=1e-6)
    assert near.value == pytest.approx(100 * (115 - critical) / 115, rel=1e-9)
    above = margin(50.0, 80.0)
    assert above.met and above.limit == pytest.approx(10 + part, rel=1e-6)
    inside = margin(90.0, 150.0)
    assert inside.value < 0 and not inside.met
    damped = margin(90.0, 150.0, least_factor=10.0)
    assert damped.sense == "for information" and "factor below 10" in damped.place


@pytest.fixture(scope="module")
def slopes():
    """AF, margin, Q0 and log decrement by stiffness and damping, in one program."""

    def decisive(p):
        machine = jeffcott(K * p[0], 10.0 * p[1])
        check = st.separation_margins(
            machine,
            "disc.x",
            120.0,
            150.0,
            {"disc": 1e-5},
            start=20.0,
            stop=300.0,
            count=1,
            points=61,
            at=AT,
        )
        factor, margin = check.assessment.findings
        chart = st.stability_chart(machine, "disc", 500.0, 400.0, at=AT)
        parts = factor.value, margin.value, margin.limit, margin.room, chart.limit / 1e3
        return jnp.stack([*parts, chart.at_anticipated])

    return decisive


def test_derivatives(slopes):
    found = assert_derivatives_agree(slopes, [1.0, 1.0], rtol=1e-6, step=1e-4)
    # Q0 = c w: 1000 here, by half of it for a relative change of the stiffness
    np.testing.assert_allclose(found[4], [0.5, 1.0], rtol=1e-9)


def test_a_shortfall_is_a_constraint(disc):
    """What it tells of the machine is what the check lacks, in %, also through `jr.optimize`."""

    def check(m, **more):
        ends = dict(start=20.0, stop=300.0, at=AT)
        return st.separation_margins(m, "disc.x", 115.0, 150.0, {"disc": 1e-5}, **ends, **more)

    short = st.Shortfall(lambda m: check(m, count=1, points=61))
    held = jr.optimize(
        disc,
        [jr.Unknown("s.damping[0]", bounds=(5.0, 40.0))],
        jr.objectives.TotalMass(),
        [short <= 0.0],
        iterations=1,
    ).constraints[0]
    lacking = -float(check(disc).assessment.findings[-1].room)
    assert lacking > 0
    assert held.value == pytest.approx(lacking, rel=1e-6)
    with pytest.raises(jr.InputError, match="must return an Assessment"):
        st.Shortfall(lambda m: 3.0)(disc)


# Stability


def test_cross_coupling_of_a_jeffcott_rotor():
    """Q0 = c w; lambda² + c lambda + k -+ i Q = 0 for the two whirls."""
    machine = jeffcott()
    chart = st.stability_chart(machine, "disc", 500.0, 1000.0, density=20.0, ratio=3.0, at=AT)
    assert chart.limit == pytest.approx(2000.0, rel=1e-12)
    for q, found in zip(chart.cross_couplings[1:], chart.log_decrements[1:]):
        roots = np.roots([1.0, C, K - 1j * float(q)])
        root = roots[np.argmax(roots.real)]
        assert found == pytest.approx(-2 * np.pi * root.real / abs(root.imag), rel=1e-9)
    ratio, decrement = chart.level_one.findings
    assert ratio.value == pytest.approx(2.0) and decrement.met
    # region B asks for ten
    assert ratio.limit == 10.0 and not ratio.met and "region B" in ratio.place
    mild = st.stability_chart(machine, "disc", 500.0, 900.0, density=20.0, ratio=1.0, at=AT)
    assert mild.level_one.met and "region A" in mild.level_one.findings[0].place
    # turned about, it drives the other whirl
    back = st.stability_chart(machine, "disc", -500.0, 1000.0, at=AT)
    assert back.limit == pytest.approx(2000.0, rel=1e-12)


def test_level_two_and_what_is_left_out():
    """A seal with cross coupling q: log decrement by the same roots, and Q0 less q."""
    machine = jr.Machine(
        {
            **jeffcott().elements(),
            "seal": jr.LinearSupport(
                np.pad([[0.0, 500.0], [-500.0, 0.0]], ((0, 4), (0, 4))), np.zeros(6)
            ),
        },
        {"s": "disc", "seal": "disc"},
    )
    (found,) = st.level_two(machine, 500.0, at=AT).findings
    root = max(np.roots([1.0, C, K - 500j]), key=lambda x: x.real)
    assert found.value == pytest.approx(-2 * np.pi * root.real / abs(root.imag), rel=1e-9)
    assert st.stability_chart(machine, "disc", 500.0, at=AT).limit == pytest.approx(1500.0)
    without = st.stability_chart(machine, "disc", 500.0, without="seal", at=AT)
    assert without.limit == pytest.approx(2000.0)
    assert not st.level_two(machine, 500.0, least_decrement=0.9, at=AT).met


# Unbalance by mode shape


def rotor(places, length=1.2, pieces=8, diameter=0.1, discs=(4,)):
    parts: dict = {"n0": jr.Node()}
    for i in range(1, pieces + 1):
        parts[f"s{i}"] = jr.FiniteElementShaft(length / pieces, diameter, elements=1)
        parts[f"n{i}"] = jr.Rotor(30.0, 0.3, 0.2) if i in discs else jr.Node()
    k = [5e8, 5e8, 0, 0, 0, 0]
    bearings = {f"b{i}": (jr.LinearSupport(k), f"n{n}") for i, n in enumerate(places)}
    return jr.Machine.in_line(parts, bearings, fixed={"n0": ("z", "phi")})


def test_unbalance_goes_where_the_mode_is_largest():
    """Symmetric between bearings: one in the middle, then two of half the mass out of phase; overhung: at the
    disc beyond, by the mass beyond."""
    machine, speed = rotor((0, 8)), 20000 * RPM
    shaft = 7810.0 * np.pi / 4 * 0.1**2 * 1.2
    first, second = st.unbalance_cases(machine, speed)
    assert (first.kind, first.unbalance.stations) == ("one", ("n4",))
    mass = sum(p.mass for p in machine.summary().parts)
    assert mass == pytest.approx(30 + shaft, rel=0.02)
    np.testing.assert_allclose(first.unbalance.amounts, 2 * 6350e-6 * mass / 20000, rtol=1e-9)
    assert second.kind == "two" and second.unbalance.stations == ("n2", "n6")
    np.testing.assert_allclose(second.unbalance.amounts, 6350e-6 * mass / 20000, rtol=1e-9)
    np.testing.assert_allclose(np.ptp(np.asarray(second.unbalance.angles)), np.pi)
    (beyond, *_) = st.unbalance_cases(rotor((1, 5), discs=(8,)), speed, count=1)
    assert (beyond.kind, beyond.unbalance.stations) == ("overhung", ("n8",))
    outside = 30 + shaft * 3 / 8
    np.testing.assert_allclose(beyond.unbalance.amounts, 2 * 6350e-6 * outside / 20000, rtol=0.01)
    with pytest.raises(jr.InputError, match="bearings: two are needed"):
        st.unbalance_cases(rotor((0, 4, 8)), speed)


def test_amplitudes_against_probes_and_clearances(disc):
    """Of the closed response: largest within the running speeds at an end, at the clearance at the peak."""

    def amplitude(w, z=0.05):
        u = (w / 100) ** 2
        return 1e-5 * u / np.sqrt((1 - u) ** 2 + 4 * z**2 * u)

    found = st.unbalance_response_check(
        disc, "disc.x", 120.0, 150.0, {"disc": 1e-5}, {"disc": 1e-3}, at=AT
    ).findings
    probe, scale, gap = found
    assert probe.value == pytest.approx(2 * amplitude(120.0), rel=1e-9)
    assert probe.limit == pytest.approx(25.4e-6)
    assert scale.value == pytest.approx(25.4e-6 / (2 * amplitude(120.0)), rel=1e-9)
    highest = 1e-5 / (2 * 0.05 * np.sqrt(1 - 0.05**2))
    assert gap.value == pytest.approx(2 * highest * float(scale.value), rel=1e-9)
    assert gap.limit == pytest.approx(0.75e-3)


def test_machines_for_both_clearances():
    bearing = jr.JournalBearing(0.05, 0.02, 5e-5, 0.02)
    machine = jr.Machine({"disc": jr.Rotor(5.0, 0.02, 0.02), "film": bearing}, {"film": "disc"})
    both = st.at_clearances(machine, {"film": (4e-5, 6e-5)})
    assert [float(m.get("film.clearance")) for m in both.values()] == [4e-5, 6e-5]
    with pytest.raises(jr.InputError, match="which has none"):
        st.at_clearances(machine, {"disc": (4e-5, 6e-5)})


# Control loops


@pytest.fixture(scope="module")
def controlled():
    loop = ActiveTorque(PD(900.0, 6.0), actuator=Actuator(bandwidth=300.0))
    parts = {"disc": jr.Rotor(1.0, 0.04, 0.03), "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0))}
    free = jr.Coupling([0.0, 0, 0, 0, 0, 1e-9])
    return jr.Machine(
        {**parts, "q": free, "loop": loop},
        {"q": ("disc", "end"), "loop": ("disc", "end")},
        fixed={"disc": ("x", "y", "z", "psi", "theta")},
    )


def test_sensitivity_of_a_loop(controlled):
    """|1/(1 + L)| of L = (k + d s) a/(J s² (s + a)), over a fine grid."""
    s = 1j * np.linspace(170.0, 185.0, 30001)
    exact = np.abs(1 / (1 + (900 + 6 * s) / (0.04 * s**2) * 300 / (s + 300))).max()
    found = st.peak_sensitivity(controlled, "loop", at=AT)
    assert found.value == pytest.approx(exact, rel=1e-8)
    (said,) = st.loop_sensitivity(controlled, "loop", at=AT).findings
    assert not said.met and "zone B" in said.place
    assert st.loop_sensitivity(controlled, "loop", accepted="B", at=AT).met
    named = st.peak_sensitivity(controlled, "loop", signal="torque", acts_on="disc.phi", at=AT)
    assert named.value == pytest.approx(float(found.value), rel=1e-12)
    with pytest.raises(jr.InputError, match="is no ActiveTorque"):
        st.peak_sensitivity(controlled, "q", at=AT)


def test_its_derivatives(controlled):
    def peak(p):
        paths = ("loop.controller.stiffness", "loop.controller.damping", "loop.actuator.bandwidth")
        scaled = p * jnp.array([900.0, 6.0, 300.0])
        return st.peak_sensitivity(controlled.set(dict(zip(paths, scaled))), "loop", at=AT).value

    assert_derivatives_agree(peak, [1.0, 1.0, 1.0], rtol=1e-6, step=1e-4)


# Figures


def test_figures(disc):
    check = st.separation_margins(
        disc, ["disc.x", "disc"], 115.0, 150.0, {"disc": 1e-5}, start=20.0, stop=300.0, at=AT
    )
    axes = check.plot()
    assert len(axes) == 2 and any("AF 9.9" in t.get_text() for t in axes[0].texts)
    (line,) = check.resonances[0].plot().lines[:1]
    assert line.get_ydata().max() == pytest.approx(2e6 * float(check.resonances[0].amplitudes[0]))
    chart = st.stability_chart(jeffcott(), "disc", 500.0, 1000.0, density=20.0, ratio=3.0, at=AT)
    assert any("2" in t.get_text() and "kN/m" in t.get_text() for t in chart.plot().texts)
    assert "region A" in [t.get_text() for t in chart.plot.screening().texts]
    case, *_ = st.unbalance_cases(rotor((0, 8)), 9000 * RPM, count=1)
    assert any("n4" in t.get_text() for t in case.plot().texts)


def test_heavily_damped_modes_hide_no_whirl():
    """A disc that hardly swings (4/5 of the critical damping, 50 rad/s) beside one that does (1/20, 100),
    joined by next to nothing: the log decrement is the second one's, 2 pi z/sqrt(1 - z²)."""
    disc = jr.Rotor(1.0, 0.01, 0.006)

    def support(w, z):
        k, c = w**2, 2 * z * w
        return jr.LinearSupport([k, k, 1e3, 1e3, 1e3, 0], [c, c, 1, 1, 1, 0])

    machine = jr.Machine.in_line(
        {"heavy": disc, "shaft": jr.Shaft(1.0, 0.001), "light": disc},
        attachments={"s1": (support(50.0, 0.8), "heavy"), "s2": (support(100.0, 0.05), "light")},
        prescribed={"heavy": {"phi": jr.ConstantSpeed(150.0)}},
    )
    (found,) = st.level_two(machine, 150.0, at=AT).findings
    assert float(found.value) == pytest.approx(2 * np.pi * 0.05 / np.sqrt(1 - 0.05**2), rel=0.01)
