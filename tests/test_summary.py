"""`machine.summary()` against solid bodies in closed form and the laws of the lever."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

G, RHO = 9.81, 7850.0


@pytest.fixture(scope="module")
def built():
    """A rotor of some length, a stepped and a rigid-element shaft, a coupling, a flange beside its station;
    supports at different places, one of them against tilting, and a given motion at the end."""
    upright = jr.LinearSupport((1e9, 1e9, 0, 0, 0, 0))
    tilting = jr.LinearSupport((2e8, 2e8, 0, 3e5, 3e5, 0))
    return jr.Machine.in_line(
        {
            "fan": jr.Rotor(12.0, 0.3, 0.2, ends=(0.1, 0.05)),
            "stepped": jr.FiniteElementShaft((0.2, 0.3), (0.05, 0.04), (0.0, 0.01), elements=1),
            "hub": jr.Rotor(3.0, 0.02, 0.012),
            "coupling": jr.Coupling((1e8, 1e8, 1e8, 1e5, 1e5, 1e5)),
            "half": jr.RigidBody(2.0, (0.01, 0.01, 0.015), mass_centre=(0.0, 0.0, 0.03)),
            "plain": jr.RigidElementShaft(0.4, 0.03, elements=2),
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
        },
        {
            "left": (upright, "fan"), "right": (tilting, "half"),
            "flange": (jr.AddedInertia(1.5, 0.004, 0.003, offset=0.02), "hub"),
            "pull": (jr.Force(-70.0, (0.0, 1.0, 0.0)), "hub"),
        },
        gravity=(0.0, -G, 0.0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def summary(built):
    return built.summary()


def tube(length, outer, inner=0.0):
    """(mass, polar, transverse about its middle) of a solid tube."""
    mass = RHO * np.pi / 4 * (outer**2 - inner**2) * length
    square = (outer**2 + inner**2) / 4  # twice the mean square of the radius, halved
    return mass, mass * square / 2, mass * (square / 4 + length**2 / 12)


def test_masses_and_places_of_solid_bodies(summary):
    parts = {part.name: part for part in summary.parts}
    # from the fan's centre: its right end at 0.05, then 0.2 and 0.3 of shaft
    a, b = tube(0.2, 0.05), tube(0.3, 0.04, 0.01)
    mass = a[0] + b[0]
    centre = (a[0] * 0.15 + b[0] * 0.40) / mass
    across = sum(x[2] + x[0] * (z - centre) ** 2 for x, z in ((a, 0.15), (b, 0.40)))
    assert parts["stepped"][2:] == pytest.approx((mass, a[1] + b[1], across, 0.5, centre), rel=1e-9)
    assert parts["plain"][2:] == pytest.approx((*tube(0.4, 0.03), 0.4, 0.75), rel=1e-9)
    assert parts["fan"][2:] == pytest.approx((12.0, 0.3, 0.2, None, 0.0))
    assert parts["half"][2:] == pytest.approx((2.0, 0.015, 0.01, None, 0.58))
    assert parts["flange"][2:] == pytest.approx((1.5, 0.004, 0.003, None, 0.57))
    all_of_them = 12 + mass + 3 + 2 + tube(0.4, 0.03)[0] + 1.5
    assert summary.mass == pytest.approx(all_of_them, rel=1e-12)
    assert "coupling" not in parts and "motor" not in parts


def test_total_mass_agrees(summary, built):
    """By another account: kinetic energies of all that moves together."""
    assert summary.mass == pytest.approx(float(jr.objectives.total_mass(built)), rel=1e-12)


def test_reactions_carry_the_weight(summary):
    assert summary.weight == pytest.approx([0.0, -G * summary.mass, 0.0], rel=1e-12)
    total = sum(force[:3] for force in summary.reactions.values()) + summary.weight
    np.testing.assert_allclose(total, 0, atol=1e-8)
    assert summary.reactions["pull"] == pytest.approx([0, -70, 0, 0, 0, 0])
    # moments about x of the left end: of F at z it is -z F
    places = {"left": 0.0, "right": 0.55, "pull": 0.55, "motor (held)": 0.95}
    moment = sum(f[3] - places[name] * f[1] for name, f in summary.reactions.items())
    assert moment == pytest.approx(summary.centre_of_gravity * summary.weight[1], rel=1e-6)
    assert set(summary.reactions) == set(places)


def test_it_prints_what_it_knows(summary):
    lines = str(summary).splitlines()
    (line,) = [line for line in lines if line.startswith("plain")]
    mass, polar, across = tube(0.4, 0.03)
    words = re.split(r"  +", line)
    assert words == [
        "plain", "RigidElementShaft", f"{mass:.5g} kg", f"{polar:.5g} kg*m^2", f"{across:.5g} kg*m^2",
        "400 mm", "750 mm",
    ]  # fmt: skip
    (line,) = [line for line in lines if line.startswith("weight")]
    assert line.split() == ["weight", f"{-G * summary.mass:.5g}", "N"]
    assert repr(summary) == str(summary)


def beam(stiffness):
    """A disc overhung by 0.2 m, supports 0.5 m apart."""
    support = jr.LinearSupport((stiffness, stiffness, 1e6, 0, 0, 1e3))
    disc, journal = jr.Rotor(20.0, 0.2, 0.11), jr.Rotor(1.0, 1e-3, 1e-3)
    line = {
        "disc": disc, "arm": jr.Shaft(0.2, 0.06), "front": journal, "shaft": jr.Shaft(0.5, 0.06),
        "rear": journal,
    }  # fmt: skip
    supports = {"a": (support, "front"), "b": (support, "rear")}
    return jr.Machine.in_line(line, supports, gravity=(0.0, -G, 0.0))


def test_the_lever_rule():
    found = beam(1e9).summary()
    assert found.reactions["a"][1] == pytest.approx(G * (20 * 0.7 / 0.5 + 1), rel=1e-6)
    assert found.reactions["b"][1] == pytest.approx(G * (-20 * 0.2 / 0.5 + 1), rel=1e-6)
    assert found.centre_of_gravity == pytest.approx((0.2 + 0.7) / 22, rel=1e-12)


def test_a_machine_that_nothing_carries_says_so():
    found = beam(0.0).summary()
    assert found.reactions == {} and found.mass == pytest.approx(22)
    assert str(found).splitlines()[-1].startswith("! no static equilibrium")


def test_traced_numbers_are_refused():
    machine = beam(1e9)
    with pytest.raises(jr.InputError, match="a summary needs known numbers"):
        jax.make_jaxpr(lambda m: machine.set({"disc.mass": m}).summary().mass)(1.0)
    with pytest.raises(jr.InputError, match="must be one number, but has shape"):
        jax.tree.map(lambda x: jnp.stack([x, x]), machine).summary()
