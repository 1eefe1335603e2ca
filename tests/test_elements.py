"""Shaft, ElasticMatrix, bearing and support: their forces against other derivations of them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree, at_instants, pull

import jaxrotor as jr
from jaxrotor.machine.field import jacobian, vector_field
from jaxrotor.machine.system import assemble

L, DO, DI = 0.3, 0.02, 0.012
E, G, RHO = 2.1e11, 8.1e10, 7850.0
A = np.pi / 4 * (DO**2 - DI**2)
I = np.pi / 64 * (DO**4 - DI**4)


def shaft(alpha=0.0, beta=0.0, **options):
    return jr.Shaft(length=L, diameter=DO, inner_diameter=DI, rayleigh=(alpha, beta), **options)


def motion(rng, size=0.1):
    """Coordinates and rates of a station, large enough for what is quadratic to show."""
    return jnp.asarray(rng.uniform(-size, size, 6)), jnp.asarray(rng.uniform(-9, 9, 6))


def ends(seed, size=0.1):
    rng = np.random.default_rng(seed)
    return motion(rng, size), motion(rng, size)


KINDS = [(t, d) for t in ("paper", "invariant") for d in ("fixed", "rotating")]


# Stiffness


def test_stiffness_is_what_beam_tables_say():
    K, _ = shaft().matrices()
    a, b = slice(0, 6), slice(6, 12)
    k1, k2, k3, k4 = (E * I * c for c in (12 / L**3, 6 / L**2, 4 / L, 2 / L))
    own = np.diag([k1, k1, E * A / L, k3, k3, G * 2 * I / L])
    own[0, 4] = own[4, 0] = -k2  # at b: a tip pulled along x leans by +theta...
    own[1, 3] = own[3, 1] = k2  # ... and along y by -psi
    np.testing.assert_allclose(K[b, b], own, rtol=1e-13, atol=1e-6)
    np.testing.assert_allclose(K[10, 4], k4, rtol=1e-13)
    np.testing.assert_allclose(K[0, 10], k2, rtol=1e-13)
    np.testing.assert_allclose(K[9, 1], -k2, rtol=1e-13)
    np.testing.assert_allclose(K, K.T, rtol=1e-13)
    np.testing.assert_allclose(K[a, b][0, 0], -k1, rtol=1e-13)


def test_cantilever_flexibility():
    """The matrix of the free end, inverted: F L³/3EI, F L²/2EI, M L/EI, T L/G Ip, F L/EA."""
    K, _ = shaft().matrices()
    flexibility = np.linalg.inv(K[6:, 6:])
    u, s, m = L**3 / (3 * E * I), L**2 / (2 * E * I), L / (E * I)
    expected = np.diag([u, u, L / (E * A), m, m, L / (G * 2 * I)])
    expected[0, 4] = expected[4, 0] = s
    expected[1, 3] = expected[3, 1] = -s
    np.testing.assert_allclose(flexibility, expected, rtol=1e-10, atol=1e-20)


@pytest.mark.parametrize("direction", range(6))
def test_rigid_motions_are_free_of_force(direction):
    """All six, at small amplitude; the turn about z at any."""
    move = np.zeros((2, 6))
    move[:, direction] = 0.37
    if direction == 3:  # about x: the far end goes down by L psi
        move[1, 1] = -0.37 * L
    if direction == 4:
        move[1, 0] = 0.37 * L
    for element in (shaft(), shaft(twist="paper")):
        K, _ = element.matrices()
        force = pull(element, *((q, jnp.zeros(6)) for q in move))
        assert np.max(np.abs(force)) < 1e-14 * np.max(np.abs(K)) * 0.37


@pytest.mark.parametrize("twist, damping", KINDS)
def test_elastic_force_is_the_gradient_of_the_energy(twist, damping):
    """The energy is a quadrature of curvatures, apart from the matrices."""
    element = shaft(twist=twist, damping=damping)  # no damping: what is left is elastic
    (qa, va), (qb, vb) = ends(1)

    def energy(q):
        return element.energy(0.0, ((q[:6], va), (q[6:], vb)), None)

    q = jnp.concatenate([qa, qb])
    force = pull(element, (qa, va), (qb, vb)).ravel()
    np.testing.assert_allclose(force, -jax.grad(energy)(q), rtol=1e-11, atol=1e-9)
    K, _ = element.matrices()
    np.testing.assert_allclose(jax.hessian(energy)(0 * q), K, rtol=1e-11, atol=1e-6)


# Damping


def consistent_mass():
    """By quadrature of the cubic shapes, component by component."""
    M, (points, shares) = np.zeros((12, 12)), np.polynomial.legendre.leggauss(6)
    for s, w in zip((points + 1) / 2, shares / 2):
        cubic = [1 - 3 * s**2 + 2 * s**3, L * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3]
        cubic.append(L * (s**3 - s**2))
        rows = np.zeros((4, 12))
        rows[0, [0, 4, 6, 10]] = cubic
        rows[1, [1, 3, 7, 9]] = np.array(cubic) * [1, -1, 1, -1]
        rows[2, [2, 8]] = rows[3, [5, 11]] = 1 - s, s
        weights = w * L * RHO * np.array([A, A, A, 2 * I])
        M += np.einsum("k,ki,kj->ij", weights, rows, rows)
    return M


def test_rayleigh_damping_is_mass_and_stiffness():
    K, C = shaft(alpha=0.7, beta=0.02).matrices()
    np.testing.assert_allclose(C, 0.7 * consistent_mass() + 0.02 * K, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("twist, damping", KINDS)
def test_force_times_velocity_is_energy_stored_and_power_lost(twist, damping):
    """In the fixed frame and in the turning one, reaction on the spin included."""
    element = shaft(0.7, 0.02, twist=twist, damping=damping)
    for seed in range(4):
        both = ends(seed)
        power = np.sum(pull(element, *both) * np.stack([v for _, v in both]))
        q, v = jnp.stack([q for q, _ in both]), jnp.stack([v for _, v in both])
        stored = jax.jvp(lambda q, v=v: element.energy(0.0, tuple(zip(q, v)), None), (q,), (v,))[1]
        lost = element.power_lost(0.0, both, None)
        assert lost > 0
        np.testing.assert_allclose(power, -stored - lost, rtol=1e-11)


def test_rotating_damping_is_that_of_the_turning_frame():
    """F = -beta K (v - W×q) on the lateral coordinates; the torque of those forces on the spin."""
    beta, W = 0.02, 70.0
    element = shaft(0, beta, twist="paper", damping="rotating")
    bare = shaft(twist="paper")
    (qa, va), (qb, vb) = ends(5)
    va, vb = va.at[5].set(W), vb.at[5].set(W)
    # the same section in a frame that turns at W: only what moves there is damped
    K, _ = bare.matrices()
    seen = []
    for q, v in ((qa, va), (qb, vb)):
        seen.append(v - W * jnp.array([-q[1], q[0], 0, -q[4], q[3], 1.0]))
    damping = -beta * (K @ np.concatenate(seen)).reshape(2, 6)
    force = pull(element, (qa, va), (qb, vb)) - pull(bare, (qa, va), (qb, vb))
    np.testing.assert_allclose(force[:, :5], damping[:, :5], rtol=1e-11, atol=1e-8)
    for q, f, total in zip((qa, qb), damping, force):
        # the force at (x, y) about z, and the moment in the turning frame's sense
        torque = q[0] * f[1] - q[1] * f[0] + q[3] * f[4] - q[4] * f[3]
        np.testing.assert_allclose(total[5], -torque, rtol=1e-10)


def test_a_bent_shaft_that_turns_as_one_is_not_damped_by_rotating_damping():
    W = 70.0
    motions = []
    for q, _ in ends(7):
        motions.append((q, jnp.array([-q[1], q[0], 0, -q[4], q[3], 1.0]) * W))
    bare, damped = shaft(), shaft(0, 0.02, damping="rotating")
    extra = pull(damped, *motions) - pull(bare, *motions)
    fixed = pull(shaft(0, 0.02), *motions) - pull(bare, *motions)
    assert np.max(np.abs(fixed)) > 1e3
    assert np.max(np.abs(extra)) < 1e-12 * np.max(np.abs(fixed))


# Twist (that it does not depend on the direction of the axes: test_about_the_axis.py)


def test_torque_of_the_published_twist():
    (qa, va), (qb, vb) = ends(13)
    element = shaft(0.0, 0.02, twist="paper")
    k = G * 2 * I / L
    expected = k * (qb[5] - qa[5]) + 0.02 * k * (vb[5] - va[5])
    got = element.torque(0.0, ((qa, va), (qb, vb)), None)
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    np.testing.assert_allclose(got, pull(element, (qa, va), (qb, vb))[0, 5], rtol=1e-12)


# In machines


def test_brg_03_onset_of_instability_by_internal_damping():
    """Genta; Vance: W = w0 (1 + c_e/c_i) = 300 rad/s for m = 1, k = 1e4, c_e = 4, c_i = 2.

    The disc sits between two equal sections, so bending alone acts on it laterally."""
    k, ce, ci = 1e4, 4.0, 2.0
    # two sections, clamped far ends: 2 * 12 EI/L³ = k
    d = (k * L**3 / 24 / E * 64 / np.pi) ** 0.25
    section = jr.Shaft(length=L, diameter=d, rayleigh=(0.0, ci / k), damping="rotating")
    wall = jr.PrescribedSpin(jr.ConstantSpeed(1.0))
    machine = jr.Machine.in_line(
        {"a": wall, "s": section, "disc": jr.Rotor(1.0, 1e-3, 1e-3), "t": section, "b": wall},
        attachments={"air": (jr.LinearSupport((0.0,) * 6, (ce, ce, 0, 9, 9, 9)), "disc")},
        fixed={"disc": ("z", "psi", "theta")},
    )
    growth = eqx.filter_jit(lambda machine, w: jacobian(assemble(machine), w))

    def largest(w, machine=machine):
        return np.max(np.linalg.eigvals(np.asarray(growth(machine, jnp.asarray(w)))).real)

    low, high = 1.0, 1000.0
    assert largest(low) < 0 < largest(high)
    for _ in range(45):
        middle = (low + high) / 2
        low, high = (middle, high) if largest(middle) < 0 else (low, middle)
    np.testing.assert_allclose(low, 300.0, rtol=1e-9)
    # as damping of the fixed frame the same numbers never destabilise
    fixed = machine.set({n: jr.Shaft(length=L, diameter=d, rayleigh=(0, ci / k)) for n in "st"})
    assert largest(1e3, fixed) < 0


def test_elastic_matrix_of_a_shaft_is_that_shaft():
    section = jr.Shaft(length=L, diameter=DO, rayleigh=(2.0, 1e-4), twist="paper")
    rng = np.random.default_rng(6)
    q, v = rng.uniform(-0.1, 0.1, (5, 3, 6)), rng.uniform(-9, 9, (5, 3, 6))

    def response(element):
        machine = jr.Machine.in_line(
            {
                "wall": jr.PrescribedSpin(jr.ConstantSpeed(30.0)),
                "shaft": element,
                "disc": jr.Rotor(2.0, 0.02, 0.012, jr.Unbalance(1e-3)),
                "tail": section,
                "end": jr.Rotor(0.5, 0.002, 0.0012),
            }
        )
        return at_instants(machine, q, v, np.linspace(0, 1, 5))

    one, two = response(section), response(jr.ElasticMatrix(*section.matrices()))
    np.testing.assert_allclose(two["shaft"].forces, one["shaft"].forces, rtol=1e-9, atol=1e-6)
    for name in ("wall", "disc", "end"):
        for what in ("acceleration", "reaction"):
            a, b = (np.asarray(getattr(each[name], what)) for each in (one, two))
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-12 * np.max(np.abs(a)))


def test_unsymmetric_matrices_keep_their_books():
    rng = np.random.default_rng(0)
    both = ends(3)
    q, v = (np.concatenate([m[i] for m in both]) for i in (0, 1))
    K, C = rng.normal(size=(2, 12, 12))
    element = jr.ElasticMatrix(K, C)
    stored = v @ (K + K.T) @ q / 2
    power = np.sum(pull(element, *both).ravel() * v)
    np.testing.assert_allclose(power, -stored - element.power_lost(0.0, both, None), rtol=1e-12)
    support = jr.LinearSupport(K[:6, :6], C[:6, :6])
    (qa, va), _ = both
    power = np.sum(pull(support, (qa, va))[0] * va)
    stored = jax.jvp(lambda q: support.energy(0.0, ((q, va),), None), (qa,), (va,))[1]
    np.testing.assert_allclose(
        power, -stored - support.power_lost(0.0, ((qa, va),), None), rtol=1e-12
    )
    np.testing.assert_allclose(pull(support, (qa, va))[0], -K[:6, :6] @ qa - C[:6, :6] @ va)


def test_support_of_six_numbers_is_the_diagonal_matrix():
    (q, v), _ = ends(4)
    k, c = np.arange(1.0, 7.0), np.arange(2.0, 8.0)
    six, full = jr.LinearSupport(k, c), jr.LinearSupport(np.diag(k), np.diag(c))
    np.testing.assert_allclose(pull(six, (q, v))[0], -k * q - c * v, rtol=1e-14)
    for name in ("energy", "power_lost"):
        one, two = (getattr(s, name)(0.0, ((q, v),), None) for s in (six, full))
        np.testing.assert_allclose(one, two, rtol=1e-14)
    np.testing.assert_allclose(six.energy(0.0, ((q, v),), None), 0.5 * np.sum(k * q**2))


# Bearing


def bearing(**given):
    numbers = dict(
        housing_mass=1.0, stiffness=1e6, damping=200.0, swing_damping=5.0, friction_arm=0.002
    )
    return jr.SelfAligningBearing(**{**numbers, **given})


def test_bearing_force_and_friction():
    q = np.array([3e-4, -4e-4, 7.0, 0.1, 0.2, 0.3])
    v = np.array([0.5, 0.25, 3.0, 0.4, -0.6, 0.0])
    fx, fy = 1e6 * 3e-4 + 200 * 0.5, -1e6 * 4e-4 + 200 * 0.25
    load = np.hypot(np.hypot(fx, fy), 1e-3)
    for speed in (900.0, 0.7, -0.7, -900.0):
        v[5] = speed
        got = pull(bearing(), (q, v))[0]
        torque = -0.002 * load * np.tanh(speed)
        np.testing.assert_allclose(got, [-fx, -fy, 0, -5 * 0.4, 5 * 0.6, torque], rtol=1e-13)
        assert got[5] * speed < 0
        np.testing.assert_allclose(
            bearing().bearing_force(0.0, ((q, v),), None), [fx, fy, 0], rtol=1e-13
        )
        lost = bearing().power_lost(0.0, ((q, v),), None)
        expected = 200 * (0.25 + 0.0625) + 5 * (0.16 + 0.36) + 0.002 * load * speed * np.tanh(speed)
        np.testing.assert_allclose(lost, expected, rtol=1e-13)


def test_bearing_takes_half_of_each_neighbour(two_rotor):
    """One rod of 70 mm at the left bearing and of 73.5 mm at the right: physics.md."""
    machine = two_rotor().filled()
    r = 0.006
    for name, length in (("left", 0.070), ("right", 0.0735)):
        m = RHO * np.pi * r**2 * length
        part = machine[name]
        np.testing.assert_allclose(part.shaft_mass, m, rtol=1e-13)
        np.testing.assert_allclose(
            part.shaft_transverse_inertia, m * (3 * r**2 + length**2) / 12, rtol=1e-13
        )
        np.testing.assert_allclose(part.shaft_polar_inertia, m * r**2 / 2, rtol=1e-13)
        weight = part.weight(np.zeros(6), np.array([0, -9.81, 0]))
        np.testing.assert_allclose(weight, [0, -9.81 * (1 + m), 0, 0, 0, 0], rtol=1e-13)
        a = part.acceleration(jnp.zeros(6), jnp.zeros(6), jnp.ones(6))
        np.testing.assert_allclose(a[:3], [1 / (1 + m), 1 / (1 + m), 1 / m], rtol=1e-13)
        v = np.arange(1.0, 7.0)
        expected = 0.5 * np.sum(v**2 / np.asarray(a))
        np.testing.assert_allclose(part.kinetic_energy(np.zeros(6), v), expected, rtol=1e-13)


def test_bearing_takes_half_of_a_hollow_neighbour():
    machine = jr.Machine.in_line(
        {"a": bearing(), "tube": shaft(), "b": jr.Rotor(1.0, 1e-3, 1e-3)}
    ).filled()
    m, l = RHO * A * L / 2, L / 2
    np.testing.assert_allclose(machine["a"].shaft_mass, m, rtol=1e-13)
    radii = (DO**2 + DI**2) / 4
    np.testing.assert_allclose(machine["a"].shaft_polar_inertia, m * radii / 2, rtol=1e-13)
    np.testing.assert_allclose(
        machine["a"].shaft_transverse_inertia, m * (3 * radii + l**2) / 12, rtol=1e-13
    )


def test_a_section_length_acts_through_the_lumped_mass_too(two_rotor):
    """Derivatives of an acceleration by a section's length, against machines built anew."""
    base = two_rotor()

    def accelerations(x):
        system = assemble(base.set({"shaft 1.length": x[0], "shaft 4.diameter": x[1]}))
        y = jnp.linspace(-1e-3, 1e-3, 2 * len(system.layout.free))
        return vector_field(jnp.zeros(()), y, system)[len(system.layout.free) :]

    assert_derivatives_agree(accelerations, [0.06, 0.012], rtol=1e-7, step=1e-3)


def test_gradients_are_finite_at_rest_without_load():
    """Where the radial load is zero its direction is not defined: the smoothing serves that."""

    def torque(x):
        part = bearing(stiffness=x[0], damping=x[1], friction_arm=x[2])
        q, v = x[3:9], x[9:15]
        return part.forces(0.0, ((q, v),), None)[0][5]

    x = jnp.concatenate([jnp.array([1e6, 200.0, 0.002]), jnp.zeros(12)])
    for derivative in (jax.jacfwd, jax.jacrev):
        got = derivative(torque)(x)
        np.testing.assert_allclose(got[:14], 0.0, atol=1e-300)
        np.testing.assert_allclose(got[14], -0.002 * 1e-3, rtol=1e-12)  # tanh'(0) N0 arm


@pytest.mark.parametrize("twist, damping", KINDS)
def test_shaft_forces_differentiate(twist, damping):
    motions = jnp.concatenate([*ends(2)[0], *ends(2)[1]])

    def force(x):
        element = jr.Shaft(
            length=x[0],
            diameter=x[1],
            inner_diameter=x[2],
            material=jr.Material(x[3] * 1e11, x[4] * 1e10, x[5] * 1e3),
            rayleigh=x[6:8],
            twist=twist,
            damping=damping,
        )
        both = (x[8:14], x[14:20]), (x[20:26], x[26:32])
        K, C = element.matrices()
        q, v = (jnp.concatenate([m[i] for m in both]) for i in (0, 1))
        own = element.forces(0.0, both, None)
        return -K @ q - C @ v + (0.0 if own is None else jnp.concatenate(own))

    x = jnp.concatenate([jnp.array([L, DO, DI, 2.1, 8.1, 7.85, 0.7, 0.02]), motions])
    assert_derivatives_agree(force, x, rtol=1e-8, step=1e-3)
