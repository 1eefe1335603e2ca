"""How finely shafts are cut: the estimate, the choice and the table, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import jaxrotor as jr

LENGTH, DIAMETER = 1.0, 0.04
STEEL = jr.FiniteElementShaft(LENGTH, DIAMETER).material
E, G, RHO = (float(getattr(STEEL, k)) for k in ("youngs_modulus", "shear_modulus", "density"))
KAPPA = 6 * (E / (2 * G)) / (7 + 6 * (E / (2 * G) - 1))  # Cowper, full section


def pinned(elements, inner=0.0, **options):
    """A shaft on two pins; free to turn at one end, to shift at the other."""
    shaft = jr.FiniteElementShaft(LENGTH, DIAMETER, inner, elements=elements, **options)
    held = {"a": ("x", "y", "z", "phi"), "b": ("x", "y")}
    return jr.Machine(
        {"a": jr.Node(), "shaft": shaft, "b": jr.Node()}, {"shaft": ("a", "b")}, fixed=held
    )


def bending(j, inner, shear, rotary):
    """rad/s of the j-th mode on two pins: Timoshenko's equation, whose waves are sines."""
    k, r2 = j * np.pi / LENGTH, (DIAMETER**2 + inner**2) / 16
    m = (inner / DIAMETER) ** 2
    nu = E / (2 * G) - 1
    kappa = 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)
    soft = E / (kappa * G) if shear else 0.0

    def equation(w):
        q = RHO * w**2 / E
        return r2 * k**4 - q * (1 + r2 * k**2 * (rotary + soft)) + q**2 * r2 * rotary * soft

    free = k**2 * np.sqrt(E * r2 / RHO)
    return brentq(equation, 0.3 * free, 1.001 * free, rtol=1e-14)


def frequencies(machine, kind, count):
    found = jr.modes(jr.linearize(machine))
    return [m.frequency for m in found if m.kind == kind][:count]


@pytest.mark.parametrize("inner", [0.0, 0.03])
@pytest.mark.parametrize("shear, rotary", [(True, True), (False, False)])
def test_the_estimate_is_the_error(inner, shear, rotary):
    options, bent = dict(shear=shear, rotary_inertia=rotary), 0
    for elements in (6, 12):
        machine = pinned(elements, inner, **options)
        found = frequencies(machine, "lateral", 4)[::2]  # each in two planes
        for j, w in enumerate(found, start=1):
            true = bending(j, inner, shear, rotary)
            told = machine["shaft"].mesh_error(true / (2 * np.pi))
            twisting = (true * np.sqrt(RHO / G) * LENGTH / elements) ** 2 / 24  # at that frequency
            assert told == pytest.approx(max(w / true - 1, twisting), rel=0.08)
            bent += told > 1.01 * twisting
    assert bent >= 2


def test_the_estimate_of_torsion():
    """Where torsion is what counts: of Bernoulli's beam so thick that its bending waves are as long."""
    shaft = jr.FiniteElementShaft(1.0, 2.0, elements=4, shear=False, rotary_inertia=False)
    machine = jr.Machine(
        {"a": jr.Node(), "shaft": shaft, "b": jr.Node()},
        {"shaft": ("a", "b")},
        fixed={"a": ("x", "y", "z", "psi", "theta", "phi"), "b": ("x", "y", "z", "psi", "theta")},
    )
    true = np.pi / 2 * np.sqrt(G / RHO)
    found = frequencies(machine, "torsional", 1)[0]
    assert shaft.mesh_error(true / (2 * np.pi)) == pytest.approx(found / true - 1, rel=0.01)


@pytest.mark.parametrize("up_to", [100.0, 500.0])
def test_auto_meets_its_frequency_and_not_much_more(up_to):
    machine = pinned("auto", up_to=up_to)
    shaft = machine["shaft"]
    assert isinstance(shaft.elements, int) and shaft.mesh_error(up_to) < 1e-3
    assert pinned(shaft.elements - 1)["shaft"].mesh_error(up_to) > 1e-3
    w = np.array(frequencies(machine, "lateral", 20)[::2])
    true = np.array([bending(j, 0.0, True, True) for j in range(1, len(w) + 1)])
    below = true < 2 * np.pi * up_to
    assert below.any() and np.all(np.abs(w / true - 1)[below] < 1e-3)


def test_auto_takes_the_thinnest_section_and_stays_when_dimensions_change():
    def shaft(*diameters, **more):
        lengths = [0.5] * len(diameters)
        return jr.FiniteElementShaft(lengths, list(diameters), elements="auto", up_to=500.0, **more)

    assert shaft(0.04, 0.02).elements == shaft(0.02, 0.02).elements > shaft(0.04, 0.04).elements
    assert shaft(0.04, 0.04, end_diameter=[0.04, 0.02]).elements == shaft(0.04, 0.02).elements
    machine = jr.Machine(
        {"a": jr.Rotor(1.0, 0.01, 0.01), "shaft": shaft(0.04, 0.04), "b": jr.Node()},
        {"shaft": ("a", "b")},
    )
    changed = machine.set({"shaft.diameter": [0.02, 0.02]})
    assert changed["shaft"].elements == machine["shaft"].elements


def test_auto_in_a_study(tmp_path):
    (tmp_path / "a.toml").write_text("""
[machine]
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.01 kg*m^2"
[[machine.line]]
name = "shaft"
kind = "FiniteElementShaft"
length = "1 m"
diameter = "4 cm"
elements = "auto"
up_to = "0.5 kHz"
[[machine.line]]
name = "end"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "100 rad/s" }
[simulation]
t_end = "0.1 s"
sample_rate = "1 kHz"
""")
    shaft = jr.load(tmp_path / "a.toml").machine["shaft"]
    assert shaft.elements == pinned("auto", up_to=500.0)["shaft"].elements
    assert shaft.up_to == 500.0


@pytest.mark.parametrize(
    "more, words",
    [
        (dict(elements="auto"), "needs the highest frequency that matters: give up_to=... in Hz"),
        (dict(elements="auto", up_to=-3.0), "up_to must be positive"),
        (dict(elements="auto", up_to=1e7), "would need .* elements, more than 1000: lower it"),
        (dict(elements="many"), "a whole number from 1 to 1000 or \"auto\", but is 'many'"),
        (dict(elements=0), "from 1 to 1000"),
    ],
)
def test_refused(more, words):
    with pytest.raises(jr.InputError, match=words):
        jr.FiniteElementShaft(1.0, 0.04, **more)


def test_auto_is_refused_where_nothing_is_known():
    def length(d):
        return jr.FiniteElementShaft(1.0, d, elements="auto", up_to=100.0).length

    with pytest.raises(jr.InputError, match="build the shaft outside of `jit`"):
        jax.jit(length)(0.04)
    with pytest.raises(jr.InputError, match="`s`: length must be positive, but is -1 m"):
        shaft = jr.FiniteElementShaft(-1.0, 0.04, elements="auto", up_to=100.0)
        jr.Machine({"a": jr.Rotor(1, 1, 1), "b": jr.Node(), "s": shaft}, {"s": ("a", "b")})


def test_convergence_goes_to_the_closed_form():
    found = jr.linear.convergence(pinned(2, shear=False, rotary_inertia=False), count=2, meshes=4)
    true = bending(1, 0.0, False, False)
    assert list(found.elements["shaft"]) == [2, 4, 8, 16]
    np.testing.assert_allclose(found.limit, true, rtol=3e-8)
    np.testing.assert_allclose(found.order, 4.0, atol=0.02)
    np.testing.assert_allclose(found.error, found.frequencies / true - 1, atol=3e-8)
    text = str(found)
    assert "1 lateral x" in text and "error, 16" in text and f"{true / (2 * np.pi):.6g}" in text
    assert "elements in each section of shaft" in text


def test_what_is_attached_to_inner_stations_stays_where_it_is():
    """A support a third along; the driven end and what is fixed stay too."""
    machine = jr.Machine(
        {
            "disc": jr.Rotor(5.0, 0.02, 0.012),
            "shaft": jr.RigidElementShaft([0.3, 0.3], [0.03, 0.03], elements=3),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(200.0)),
            "support": jr.LinearSupport([1e6, 2e6, 0, 0, 0, 0], [0.0] * 6),
        },
        {"shaft": ("disc", "end"), "support": "shaft.2"},
        fixed={"disc": ("z",)},
    )
    found = jr.linear.convergence(machine, 200.0, 4)
    assert list(found.elements["shaft"]) == [3, 6, 12]
    # a shaft whose pieces number as many from the first, built so
    parts = machine.elements() | {
        "shaft": jr.RigidElementShaft([0.3, 0.3], [0.03, 0.03], elements=12)
    }
    fine = jr.Machine(
        parts, {"shaft": ("disc", "end"), "support": "shaft.8"}, fixed={"disc": ("z",)}
    )
    w = [m.frequency for m in jr.modes(jr.linearize(fine, 200.0), 4)]
    np.testing.assert_allclose(found.frequencies[-1], w, rtol=1e-9)
    np.testing.assert_allclose(found.order, 2.0, atol=0.1)
    assert jnp.all(jnp.diff(jnp.abs(jnp.asarray(found.error)), axis=0) < 0)


def test_convergence_needs_a_mesh():
    with pytest.raises(jr.InputError, match="no shaft of it is cut into elements"):
        jr.linear.convergence(jr.Machine({"a": jr.Rotor(1.0, 0.1, 0.1)}, {}))
