"""What a study's [standards] and [torsional] say of seals, housings, control loops, films and gears: against
closed forms and two-by-two systems by hand."""

import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor import standards as st
from jaxrotor.elements import PD, ActiveTorque, Actuator
from jaxrotor.standards.sensitivities import derivatives
from jaxrotor.study.assessing import assessed

M, K, C, SEAL = 1.0, 1e4, 20.0, 10.0
TOP = 120.0  # rad/s
LATERAL = ("z", "psi", "theta")


def read(folder, machine, sections):
    path = folder / "study.toml"
    path.write_text(sections + machine.to_toml())
    return jr.load(path, run=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A disc on a spring and damper, a seal that damps it too, and a loop that holds its angle."""
    flat = np.array([1.0, 1.0, 0, 0, 0, 0])
    machine = jr.Machine(
        {
            "disc": jr.Rotor(M, 0.04, 0.03),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "support": jr.LinearSupport(K * flat, C * flat),
            "seal": jr.LinearSupport(np.zeros(6), SEAL * flat),
            "free": jr.Coupling([0.0, 0, 0, 0, 0, 1e-9]),
            "loop": ActiveTorque(PD(900.0, 6.0), actuator=Actuator(bandwidth=300.0)),
        },
        {
            "support": "disc",
            "seal": "disc",
            "free": ("disc", "end"),
            "loop": ("disc", "end"),
        },
        fixed={"disc": LATERAL},
    )
    sections = f"""
title = "Parts"
[standards]
speeds = ["80 rad/s", "{TOP} rad/s"]
unbalance = {{ disc = "5 g*mm" }}
state = "undeformed"
[standards.stability]
stations = "disc"
cross_coupling = "500 N/m"
without = ["seal"]
[[standards.magnetic]]
name = "loop"
accepted = "B"
[[standards.vibration]]
kind = "housing"
place = "disc.x"
accepted = "B"
[[standards.vibration]]
kind = "housing"
place = "disc.y"
value = "2 mm/s"
group = "2"
support = "flexible"
"""
    return read(tmp_path_factory.mktemp("parts"), machine, sections)


def test_seals_loops_and_housings(study):
    """Level 1 without the seal, level 2 with it: Q0 = c w, and roots of m s² + c s + k - i q; the largest
    |1/(1 + L)|; velocities of m e w² / (k - m w² + i c w)."""
    natural = np.sqrt(K / M)
    found = study.assess().findings
    ratio, at_expected, level_two, loop, computed, measured = found
    assert ratio.value == pytest.approx(C * natural / 500.0, rel=1e-10)

    def decrement(c, q):
        root = max(np.roots([M, c, K - 1j * q]), key=lambda x: x.real)
        return -2 * np.pi * root.real / abs(root.imag)

    assert at_expected.value == pytest.approx(decrement(C, 500.0), rel=1e-9)
    assert level_two.value == pytest.approx(decrement(C + SEAL, 0.0), rel=1e-9)
    s = 1j * np.linspace(170.0, 185.0, 30001)
    exact = np.abs(1 / (1 + (900 + 6 * s) / (0.04 * s**2) * 300 / (s + 300))).max()
    assert loop.value == pytest.approx(exact, rel=1e-8) and loop.limit == 4.0
    whirl = 5e-6 * TOP**2 / abs(K - M * TOP**2 + 1j * (C + SEAL) * TOP)
    assert computed.value == pytest.approx(TOP * whirl / np.sqrt(2), rel=1e-9)
    # ISO 20816-3, zone B: large machines on rigid supports 4.5 mm/s, medium ones on flexible supports 4.5
    assert measured.value == pytest.approx(2e-3) and measured.met
    assert [float(x.limit) for x in (computed, measured)] == pytest.approx([4.5e-3, 4.5e-3])


def test_what_moves_a_loop(study):
    """Against central differences of the same number in another machine."""
    loop = [i for i in assessed(study.machine, study.standards, None).items if i.finding.sense]
    (one,) = [item for item in loop if "sensitivity" in item.finding.check]
    (slopes,) = derivatives([one.moves])
    path, h = "loop.controller.stiffness", 0.05

    def room(stiffness):
        value = st.peak_sensitivity(study.machine.set({path: stiffness}), "loop", at="undeformed")
        return -float(value.value)

    expected = (room(900.0 + h) - room(900.0 - h)) / (2 * h)
    assert slopes[path] == pytest.approx(expected, rel=1e-6)


def test_films_at_both_clearances(tmp_path):
    """Amplitudes of a disc in an oil film, whose clearance is the least and the greatest: of the two-by-two
    systems of its film's coefficients."""
    film = jr.JournalBearing(0.05, 0.02, 5e-5, 0.02)
    machine = jr.Machine(
        {"disc": jr.Rotor(5.0, 0.02, 0.02), "film": film},
        {"film": "disc"},
        (0.0, -9.81, 0.0),
        fixed={"disc": LATERAL},
    )
    ends = 4e-5, 6e-5
    sections = f"""
[standards]
speeds = ["200 rad/s", "{TOP * 2} rad/s"]
probes = ["disc"]
unbalance = {{ disc = "50 g*mm" }}
films = {{ film = ["{ends[0]} m", "{ends[1]} m"] }}
"""
    findings = read(tmp_path, machine, sections).assess().findings
    told = [f for f in findings if f.check.startswith("amplitude at probes")]
    assert len(told) == 2
    for which, clearance, finding in zip(("least", "greatest"), ends, told):
        sizes = []
        for w in np.linspace(200.0, 2 * TOP, 9):
            model = jr.linearize(machine.set({"film.clearance": clearance}), w)
            rows = [model.row("disc.x"), model.row("disc.y")]
            part = np.ix_(rows, rows)
            M_, C_, K_ = (np.asarray(x)[part] for x in (model.M, model.C + model.G, model.K))
            force = 5e-5 * w**2 * np.array([1.0, -1j])
            x, y = np.linalg.solve(K_ + 1j * w * C_ - w**2 * M_, force)
            sizes.append(0.5 * (abs(x + 1j * y) + abs(x - 1j * y)))
        assert float(finding.value) == pytest.approx(2 * max(sizes), rel=1e-8)
        assert which in finding.place
