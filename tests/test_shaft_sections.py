"""Sections of shafts with mass: cones and tapered bores against quadrature, Kirchhoff's and Bessel's closed
forms, and stepped cylinders; profiles; materials by name and temperature."""

import tomllib

import jax
import jsonschema
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv
from test_shaft_loads import BERNOULLI, CLAMPED, METAL, RHO, E, G, lateral

import jaxrotor as jr
from jaxrotor.study.schema import schema as study_schema

L = 0.6


def element(shaft):
    ((_, found, _),) = shaft.parts().connectors
    return jax.tree.map(lambda x: np.asarray(x[..., 0]), found)


def test_a_tapered_element_against_quadrature():
    """Cubic shapes of a Bernoulli beam, a rod's in tension and torsion, over the section's own area and
    second moment, by SciPy's adaptive quadrature."""
    outer, bore = (0.06, 0.045), (0.03, 0.01)
    one = element(
        jr.FiniteElementShaft(
            L,
            outer[0],
            bore[0],
            outer[1],
            end_inner_diameter=bore[1],
            material=METAL,
            elements=1,
            shear=False,
        )
    )

    def area(s, power=2):
        do, di = (a + (b - a) * s for a, b in (outer, bore))
        return np.pi * (do**power - di**power)

    def whole(f):
        return quad(f, 0.0, 1.0, epsabs=0, epsrel=1e-12)[0]

    cubics = (
        [1, 0, -3, 2],
        [0, L, -2 * L, L],
        [0, 0, 3, -2],
        [0, 0, -L, L],
    )  # (w, slope) at both ends
    w = [np.polynomial.Polynomial(c) for c in cubics]

    def pair(a, b):
        bent = whole(lambda s: area(s, 4) / 64 * a.deriv(2)(s) * b.deriv(2)(s))
        turned = whole(lambda s: area(s, 4) / 64 * a.deriv()(s) * b.deriv()(s))
        return E * bent / L**3, RHO * (L * whole(lambda s: area(s) / 4 * a(s) * b(s)) + turned / L)

    for a, i in zip(w, (0, 4, 6, 10)):
        for b, j in zip(w, (0, 4, 6, 10)):
            np.testing.assert_allclose([one.K[i, j], one.M[i, j]], pair(a, b), rtol=1e-10)
    np.testing.assert_allclose(one.K[2, 2], E / L * whole(lambda s: area(s) / 4), rtol=1e-10)
    np.testing.assert_allclose(one.K[5, 5], G / L * whole(lambda s: area(s, 4) / 32), rtol=1e-10)
    mass = RHO * L * whole(lambda s: area(s) / 4 * (1 - s) * s)
    np.testing.assert_allclose(one.M[2, 8], mass, rtol=1e-10)
    # a frustum's volume less another's
    volume = frusta([(0.0, outer[0], bore[0]), (L, outer[1], bore[1])])
    assert one.M[2, [2, 8]].sum() + one.M[8, [2, 8]].sum() == pytest.approx(RHO * volume, rel=1e-12)


def cone(left, right, **given):
    given = dict(material=METAL, elements=16) | BERNOULLI | given
    return jr.FiniteElementShaft(L, left, end_diameter=right, **given)


def lowest(shaft, count):
    """Natural frequencies of a cantilever, rad/s; each of two planes is told once."""
    K, M, _ = lateral(shaft, CLAMPED)
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[: 2 * count : 2])


def exact_cone(ratio, count):
    """w L² sqrt(rho A/EI), with A and I of the clamped end, of a cantilever whose diameter falls to `ratio`
    at its free end. With z from the apex the shapes are f_2(2 k sqrt(z))/z, f a Bessel function J, Y, I or K
    (Kirchhoff 1879; Conway, Becker & Dubil, J. Appl. Mech. 31 (1964) 329)."""
    kinds = [(jv, -1, 1), (yv, -1, 1), (iv, 1, 1), (kv, -1, -1)]

    def gap(k):
        # z = 1: w, w'; z = ratio: w'', (z^4 w'')'
        one, free = 2 * k, 2 * k * np.sqrt(ratio)
        columns = [[f(2, one), s * f(3, one), f(4, free), t * f(3, free)] for f, s, t in kinds]
        return np.linalg.det([c / np.max(np.abs(c)) for c in columns])

    grid = np.linspace(1.0, 9.0 / (1 - ratio), 400)
    values = [gap(k) for k in grid]
    roots = [
        brentq(gap, a, b, xtol=1e-13)
        for a, b, x, y in zip(grid, grid[1:], values, values[1:])
        if x * y < 0
    ]
    return (np.array(roots[:count]) * (1 - ratio)) ** 2


def unit(diameter, bore=0.0):
    """rad/s: sqrt(EI/(rho A))/L²."""
    return np.sqrt(E * (diameter**2 + bore**2) / 16 / RHO) / L**2


def test_kirchhoffs_cone():
    """The whole cone's are known as 8.719, 21.15 and 38.45 (Kirchhoff 1879; Timoshenko, Vibration Problems in
    Engineering (1937), sec. 57, for the first): the closed form tends to them."""
    np.testing.assert_allclose(exact_cone(1e-4, 3), [8.719, 21.15, 38.45], rtol=5e-4)
    found = lowest(cone(0.05, 0.05 * 1e-3, elements=60), 3) / unit(0.05)
    np.testing.assert_allclose(found, exact_cone(1e-3, 3), rtol=1e-6)


@pytest.mark.parametrize("bore", [0.0, 0.6])
def test_cones_and_tapered_tubes(bore):
    """Frequencies of cantilevers that fall to half of their diameter, the bore with it: from above, by the
    fourth power of the element's length; and by stepped cylinders, by the square of the step."""
    left, right = 0.05, 0.025
    exact = exact_cone(0.5, 3) * unit(left, bore * left)
    errors = []
    for n in (16, 32):
        given = dict(inner_diameter=bore * left, end_inner_diameter=bore * right, elements=n)
        errors.append(lowest(cone(left, right, **given), 3) / exact - 1)
    assert np.all(errors[1] > 0) and errors[1][0] < 1e-7
    np.testing.assert_allclose(errors[0] / errors[1], 16.0, rtol=0.05)

    stepped = []
    for n in (8, 16):
        d = left + (right - left) * (np.arange(n) + 0.5) / n
        given = dict(material=METAL, elements=2) | BERNOULLI
        steps = jr.FiniteElementShaft([L / n] * n, d, bore * d, **given)
        stepped.append(lowest(steps, 2) / exact[:2] - 1)
    np.testing.assert_allclose(stepped[0] / stepped[1], 4.0, rtol=0.15)
    assert np.all(np.abs(stepped[1]) < 5e-3)


def test_a_bore_that_tapers_through_is_refused():
    with pytest.raises(
        jr.InputError,
        match="inner_diameter must be smaller than the diameter, but is 0.03 against 0.025 m",
    ):
        jr.Machine.in_line(
            {"a": jr.Node(), "s": cone(0.05, 0.025, end_inner_diameter=0.03), "b": jr.Node()}
        )


def test_rigid_pieces_take_the_same_bore():
    """Mass of the pieces: within the square of the step of the frustums'."""
    given = dict(material=METAL, elements=40, end_inner_diameter=0.03)
    shaft = jr.RigidElementShaft(L, 0.05, 0.01, 0.04, **given)
    machine = jr.Machine.in_line({"a": jr.Node(), "s": shaft, "b": jr.Node()})
    frustum = [np.pi * L / 12 * (a * a + a * b + b * b) for a, b in ((0.05, 0.04), (0.01, 0.03))]
    exact = RHO * (frustum[0] - frustum[1])
    assert float(jr.objectives.total_mass(machine)) == pytest.approx(exact, rel=2e-4)


ROWS = [
    *[(0.0, 0.03), (0.1, 0.03), (0.1, 0.05, 0.01)],
    *[(0.3, 0.06, 0.02), (0.3, 0.04, 0.02), (0.5, 0.04, 0.02)],
]


def frusta(rows):
    """Volume between rows, m³, bore left out."""
    rows = [(*row, 0.0)[:3] for row in rows]
    return sum(
        np.pi * (b[0] - a[0]) / 12 * (a[i] ** 2 + a[i] * b[i] + b[i] ** 2) * sign
        for a, b in zip(rows, rows[1:])
        for i, sign in ((1, 1), (2, -1))
    )


def pinned(line):
    names = list(line)
    fixed = {names[0]: ("x", "y", "z", "phi"), names[-1]: ("x", "y")}
    return jr.Machine.in_line(line, fixed=fixed)


def test_a_shaft_from_its_drawing():
    """Sections by hand, mass by frusta; pieces between stations add up to the same shaft."""
    shaft = jr.FiniteElementShaft.from_profile(ROWS, material=METAL)
    np.testing.assert_allclose(shaft.length, [0.1, 0.2, 0.2], rtol=1e-14)
    np.testing.assert_allclose(shaft.diameter, [0.03, 0.05, 0.04], rtol=1e-14)
    np.testing.assert_allclose(shaft.end_diameter, [0.03, 0.06, 0.04], rtol=1e-14)
    np.testing.assert_allclose(shaft.end_inner_diameter, [0.0, 0.02, 0.02], rtol=1e-14)
    whole = pinned({"a": jr.Node(), "s": shaft, "b": jr.Node()})
    wheel = jr.Rotor(4.0, 0.02, 0.012)
    stations = {"bearing": (0.05, jr.Node()), "wheel": (0.2, wheel), "end": (0.5, jr.Node())}
    line = jr.elements.line_from_profile(ROWS, stations, longest=0.06, material=METAL)
    assert list(line) == [
        "shaft left end",
        "shaft 1",
        "bearing",
        "shaft 2",
        "wheel",
        "shaft 3",
        "end",
    ]
    mass = [float(jr.objectives.total_mass(m)) for m in (whole, pinned(line))]
    np.testing.assert_allclose(mass, [RHO * frusta(ROWS), RHO * frusta(ROWS) + 4.0], rtol=1e-12)
    # half of a cone ends half way
    assert float(line["shaft 2"].end_diameter[-1]) == pytest.approx(0.055)
    assert max(float(np.max(line[f"shaft {k}"].length)) for k in (1, 2, 3)) <= 0.06

    steps = jr.FiniteElementShaft.from_profile(ROWS, between="cylinders")
    np.testing.assert_allclose(steps.diameter, [0.03, 0.05, 0.04], rtol=1e-14)
    assert steps.end_diameter is None


def test_a_long_rotor_takes_its_length():
    stations = {"wheel": (0.2, jr.Rotor(4.0, 0.02, 0.012, ends=(0.03, 0.05)))}
    line = jr.elements.line_from_profile([(0.0, 0.03), (0.5, 0.03)], stations)
    assert float(line["shaft 1"].length[0]) == pytest.approx(0.17)
    assert float(line["shaft 2"].length[0]) == pytest.approx(0.25)


def test_a_profile_is_differentiable_by_its_diameters():
    """Mass of a frustum by both diameters, exactly."""

    def mass(d):
        rows = [(0.0, d[0]), (L, d[1])]
        shaft = jr.FiniteElementShaft.from_profile(rows, material=METAL)
        ((_, found, _),) = shaft.parts().connectors
        return found.M[2, [2, 8], 0].sum() + found.M[8, [2, 8], 0].sum()

    a, b = 0.05, 0.03
    exact = RHO * np.pi * L / 12 * np.array([2 * a + b, a + 2 * b])
    for jacobian in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(jax.jit(jacobian(mass))(np.array([a, b])), exact, rtol=1e-12)


CSV = """# drawing 4711
Position [mm]; outer diameter (mm); bore [cm]; note
0; 30; ; left
100; 30; 0; step
100; 50; 1;
300; 60; 2;
300; 40; 2;
500; 40,0; 2; right
"""
STUDY = """
[machine]
fixed = { "shaft left end" = ["x", "y", "z", "phi"], end = ["x", "y"] }
[machine.profile]
WHAT
material = { name = "42CrMo4", temperature = "120 degC" }
axial_force = "-3 kN"
[[machine.line]]
name = "wheel"
kind = "Rotor"
position = "200 mm"
mass = "4 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.012 kg*m^2"
[[machine.line]]
name = "end"
kind = "Node"
position = "0.5 m"
[[machine.attachments]]
name = "load"
kind = "Force"
at = "shaft 1.1"
value = "1 N"
"""
IN_ROWS = """unit = "mm"
rows = [[0, 30, 0], [100, 30], [100, 50, 10], [300, 60, 20], [300, 40, 20], ["0.5 m", 40, 20]]"""


def study(tmp_path, what, old="", new=""):
    file = tmp_path / "study.toml"
    file.write_text(STUDY.replace("WHAT", what).replace(old, new))
    return jr.load(file, run=False).machine


def test_a_profile_in_a_study(tmp_path):
    """From rows and from a CSV file beside it: the machine that Python makes, and one that is written and
    read again is the same."""
    csv = CSV.replace("0; 30; ;", "0; 30; 0;")
    (tmp_path / "rotor.csv").write_text(csv)
    np.testing.assert_allclose(
        jr.elements.read_profile(tmp_path / "rotor.csv"), [(*r, 0.0)[:3] for r in ROWS], rtol=1e-12
    )
    hot = jr.Material.named("42CrMo4", 393.15)
    stations = {"wheel": (0.2, jr.Rotor(4.0, 0.02, 0.012)), "end": (0.5, jr.Node())}
    line = jr.elements.line_from_profile(ROWS, stations, material=hot, axial_force=-3e3)
    for what in (IN_ROWS, 'file = "rotor.csv"'):
        machine = study(tmp_path, what)
        assert machine.elements().keys() == {*line, "load"}
        for name in ("shaft 1", "shaft 2"):
            assert machine[name].material.name == "42CrMo4"
            for a, b in zip(jax.tree.leaves(machine[name]), jax.tree.leaves(line[name])):
                np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15)
    for text in (STUDY.replace("WHAT", IN_ROWS), machine.to_toml()):
        jsonschema.validate(tomllib.loads(text), study_schema())
    (tmp_path / "again.toml").write_text(machine.to_toml())
    again = jr.load(tmp_path / "again.toml", run=False).machine
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(machine), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "old, new, sentence",
    [
        ('unit = "mm"\n', "", "`profile`: rows.0. is a bare number"),
        ("[300, 60, 20]", "[90, 60, 20]", "`profile`: row 4: positions must not fall, but 0.09 m follows"),
        ("[300, 60, 20]", "[300, 60, 70]", "`profile`: row 4: bore must be smaller than the diameter"),
        ("[100, 50, 10]", "[100, 40, 0], [100, 50, 10]", "`profile`: row 4: is the third at 0.1 m"),
        ('position = "200 mm"', "", 'line "wheel"`: stands beside the profile without a position'),
        ('position = "200 mm"', 'position = "0.9 m"', "the position of `wheel` must lie on the profile"),
        ('position = "200 mm"', 'position = "9 kg"', 'line "wheel"`: position must be in m'),
        ("42CrMo4", "42CrMo5", "must be a metal of the tables, .* did you mean '42crmo4'"),
        ("120 degC", "900 degC", "the temperature of 42CrMo4 must lie between 200 and 800 K"),
        ('unit = "mm"', 'unit = "mm"\nfile = "rotor.csv"', "either a file or rows, but both are given"),
        ('unit = "mm"', 'unit = "mm"\nlongst = "5 mm"', "there is no `longst`: did you mean `longest`"),
        ("[machine.profile]", "[machine.profil]", "no `profil`: did you mean `profile`"),
    ],
)  # fmt: skip
def test_bad_profiles_in_a_study(tmp_path, old, new, sentence):
    with pytest.raises(jr.InputError, match=sentence) as error:
        study(tmp_path, IN_ROWS, old, new)
    assert len(error.value.problems) <= (5 if "profil]" in new else 3)


@pytest.mark.parametrize(
    "old, new, sentence",
    [
        ("Position [mm]", "Position", "column position must name its unit of length"),
        ("Position [mm]", "z0 [mm]", "has no column position"),
        ("60; 2;", "sixty; 2;", "line 6: diameter must be a number, but is `sixty`"),
        ("outer diameter (mm)", "diameter [kg]", "column diameter must name its unit of length"),
    ],
)
def test_bad_files(tmp_path, old, new, sentence):
    (tmp_path / "rotor.csv").write_text(CSV.replace("0; 30; ;", "0; 30; 0;").replace(old, new))
    with pytest.raises(jr.InputError, match=sentence):
        jr.elements.read_profile(tmp_path / "rotor.csv")


# GPa at what °C: as printed, for steel by ASME II-D TM-1, for the others MMPDS's modulus times the figure's
# part of it.
PRINTED = {
    "S355": [(-75, 209), (25, 202), (200, 192), (550, 137)],
    "X5CrNi18-10": [(25, 195), (400, 169), (700, 140)],
    "42CrMo4": [(26.85, 200 * 1.001), (226.85, 200 * 0.942), (426.85, 200 * 0.828)],
    "Inconel 718": [(26.85, 203 * 1.006), (426.85, 203 * 0.900), (726.85, 203 * 0.785)],
    "Ti-6Al-4V": [(26.85, 116.5 * 0.996), (326.85, 116.5 * 0.806)],
    "EN AW-6061": [(26.85, 68.3 * 1.004), (226.85, 68.3 * 0.873)],
}


@pytest.mark.parametrize("name", PRINTED)
def test_materials_by_name(name):
    for celsius, modulus in PRINTED[name]:
        metal = jr.Material.named(name, celsius + 273.15)
        assert float(metal.youngs_modulus) / 1e9 == pytest.approx(modulus, abs=0.2)
        nu = float(metal.youngs_modulus / metal.shear_modulus) / 2 - 1
        assert nu == pytest.approx(metal.poissons_ratio, rel=1e-12)
    cold, hot = (jr.Material.named(name, t) for t in (293.15, 493.15))
    swell = (1 + float(hot.expansion) * 200.0) ** 3
    assert float(cold.density / hot.density) == pytest.approx(swell, rel=1e-12)
    assert 5e-3 < swell - 1 < 2e-2 and metal.source


def test_other_sources_agree_within_what_heats_scatter():
    """High Temp Metals' own moduli of alloy 718 (21 to 649 °C) with MMPDS's: 4 %."""
    for celsius, modulus in [(21, 208), (93, 205), (204, 202), (316, 194), (427, 186), (649, 172)]:
        found = float(jr.Material.named("inconel 718", celsius + 273.15).youngs_modulus)
        assert found / 1e9 == pytest.approx(modulus, rel=0.04)


def test_derivatives_by_temperature():
    """A cantilever's frequencies go with sqrt(E/rho): forward, reverse, differences; by the parameter's
    path."""
    shaft = cone(0.05, 0.05, material=jr.Material.named("42CrMo4", 560.0), elements=2)
    machine = jr.Machine.in_line({"a": jr.Node(), "s": shaft, "b": jr.Node()})

    def ratio(t):
        m = machine.set({"s.material.temperature": t})["s"].material
        return m.youngs_modulus / m.density

    slopes = [float(d(ratio)(560.0)) for d in (jax.jacfwd, jax.jacrev)]
    h = 0.01
    central = (float(ratio(560.0 + h)) - float(ratio(560.0 - h))) / (2 * h)
    np.testing.assert_allclose(slopes, central, rtol=1e-6)
    slow, fast = (
        lowest(machine.set({"s.material.temperature": t})["s"], 1)[0] for t in (700.0, 300.0)
    )
    expected = float(ratio(700.0) / ratio(300.0)) ** 0.5
    assert slow / fast == pytest.approx(expected, rel=1e-9)
    with pytest.raises(jr.InputError, match="`s`: the temperature of 42CrMo4 must lie between 200"):
        machine.set({"s.material.temperature": 20.0})
