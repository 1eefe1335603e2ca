"""Sections of shafts with mass: cones and tapered bores against quadrature, Kirchhoff's and Bessel's closed
forms, and stepped cylinders; profiles; materials by name and temperature."""

import jax
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv
from test_shaft_loads import BERNOULLI, CLAMPED, E, G, METAL, RHO, lateral

import jaxrotor as jr

L = 0.6


def element(shaft):
    ((_, found, _),) = shaft.parts().connectors
    return jax.tree.map(lambda x: np.asarray(x[..., 0]), found)


def test_a_tapered_element_against_quadrature():
    """Cubic shapes of a Bernoulli beam, a rod's in tension and torsion, over the section's own area and second
    moment, by SciPy's adaptive quadrature."""
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

    # of (w, slope) at both ends
    w = [np.polynomial.Polynomial(c) for c in ([1, 0, -3, 2], [0, L, -2 * L, L], [0, 0, 3, -2], [0, 0, -L, L])]  # fmt: skip
    at = [0, 4, 6, 10]
    for i, a in enumerate(at):
        for j, b in enumerate(at):
            bent = whole(lambda s: area(s, 4) / 64 * w[i].deriv(2)(s) * w[j].deriv(2)(s))  # noqa: B023
            inertia = whole(
                lambda s: area(s) / 4 * w[i](s) * w[j](s)  # noqa: B023
                + area(s, 4) / 64 * w[i].deriv()(s) * w[j].deriv()(s) / L**2  # noqa: B023
            )
            np.testing.assert_allclose(one.K[a, b], E * bent / L**3, rtol=1e-10)
            np.testing.assert_allclose(one.M[a, b], RHO * L * inertia, rtol=1e-10)
    np.testing.assert_allclose(one.K[2, 2], E / L * whole(lambda s: area(s) / 4), rtol=1e-10)
    np.testing.assert_allclose(one.K[5, 5], G / L * whole(lambda s: area(s, 4) / 32), rtol=1e-10)
    mass = RHO * L * whole(lambda s: area(s) / 4 * (1 - s) * s)
    np.testing.assert_allclose(one.M[2, 8], mass, rtol=1e-10)
    # a frustum's volume less another's
    volume = sum(sign * np.pi * L / 12 * (a * a + a * b + b * b) for sign, (a, b) in ((1, outer), (-1, bore)))  # fmt: skip
    assert one.M[2, [2, 8]].sum() + one.M[8, [2, 8]].sum() == pytest.approx(RHO * volume, rel=1e-12)


def cone(left, right, **given):
    given = dict(material=METAL, elements=16) | BERNOULLI | given
    return jr.FiniteElementShaft(L, left, end_diameter=right, **given)


def lowest(shaft, count):
    """Natural frequencies of a cantilever, rad/s; each of two planes is told once."""
    K, M, _ = lateral(shaft, CLAMPED)
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[: 2 * count : 2])


def exact_cone(ratio, count):
    """w L² sqrt(rho A/EI), with A and I of the clamped end, of a cantilever whose diameter falls to `ratio` at
    its free end. With z from the apex the shapes are f_2(2 k sqrt(z))/z, f a Bessel function J, Y, I or K
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
        match="inner_diameter must be smaller than the diameter, but is 0.03 against 0.025 m at the right end",
    ):
        jr.Machine.in_line(
            {"a": jr.Node(), "s": cone(0.05, 0.025, end_inner_diameter=0.03), "b": jr.Node()}
        )


def test_rigid_pieces_take_the_same_bore():
    """Mass of the pieces: within the square of the step of the frustums'."""
    shaft = jr.RigidElementShaft(L, 0.05, 0.01, 0.04, material=METAL, elements=40, end_inner_diameter=0.03)  # fmt: skip
    machine = jr.Machine.in_line({"a": jr.Node(), "s": shaft, "b": jr.Node()})
    frustum = [np.pi * L / 12 * (a * a + a * b + b * b) for a, b in ((0.05, 0.04), (0.01, 0.03))]
    exact = RHO * (frustum[0] - frustum[1])
    assert float(jr.objectives.total_mass(machine)) == pytest.approx(exact, rel=2e-4)
