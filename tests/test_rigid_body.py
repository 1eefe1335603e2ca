"""Rotor, RigidBody: their equations against those of a cloud of point masses.

The cloud shares no line with the program: rotations from SciPy, M and h by the virtual work of each
point's mass times its acceleration. The energies are checked against the same points, and Lagrange's
equations of the program's own energy against its accelerations.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import (
    TIGHT,
    assert_derivatives_agree,
    axes,
    cloud,
    momenta,
    newton,
    place,
    point_jacobian,
    unbalanced_cloud,
)
from scipy.spatial.transform import Rotation

import jaxrotor as jr

TENSOR = np.array([[2.1, 0.3, -0.2], [0.3, 1.4, 0.25], [-0.2, 0.25, 1.9]])
CENTRE = np.array([0.2, -0.1, 0.15])

# element, the same body as points
BODIES = {
    "balanced rotor": (jr.Rotor(1.3, 0.8, 0.5), unbalanced_cloud(1.3, 0.8, 0.5)),
    "long rotor": (
        jr.Rotor(1.3, 0.2, 2.5, jr.Unbalance(eccentricity=0.3, angle=0.4)),
        unbalanced_cloud(1.3, 0.2, 2.5, 0.3, 0.4),
    ),
    "unbalanced rotor": (
        jr.Rotor(1.3, 0.8, 0.5, jr.Unbalance(0.3, 0.4, 0.35, -1.1)),
        unbalanced_cloud(1.3, 0.8, 0.5, 0.3, 0.4, 0.35, -1.1),
    ),
    "turned rotor": (
        jr.Rotor(1.3, 0.8, 0.5, jr.Unbalance(0.3, 0.4, 0.35, -1.1), angle=0.7),
        unbalanced_cloud(1.3, 0.8, 0.5, 0.3, 0.4 + 0.7, 0.35, -1.1 + 0.7),
    ),
    "principal body": (
        jr.RigidBody(1.3, (1.0, 1.5, 2.2)),
        cloud(1.3, np.diag([1.0, 1.5, 2.2]), np.zeros(3)),
    ),
    "any body": (jr.RigidBody(1.3, TENSOR, CENTRE), cloud(1.3, TENSOR, CENTRE)),
}

each_body = pytest.mark.parametrize("name", BODIES)


def states(count=12, seed=3):
    """Large displacements, tilts, speeds and loads; the tilt stays off the angles' pole."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, (count, 6)) * np.array([1, 1, 1, 3, 1.2, 9])
    v = rng.uniform(-3, 3, (count, 6))
    Q = rng.uniform(-5, 5, (count, 6))
    return q, v, Q


@each_body
def test_accelerations_are_the_points(name):
    element, points = BODIES[name]
    given = states()
    accelerations = np.asarray(jax.jit(jax.vmap(element.acceleration))(*given))
    for q, v, Q, a in zip(*given, accelerations):
        M, h = newton(q, v, *points)
        terms = np.abs(M) @ np.abs(a) + np.abs(h) + np.abs(Q)
        np.testing.assert_array_less(np.abs(M @ a + h - Q), 1e-12 * terms.max())
        np.testing.assert_allclose(a, np.linalg.solve(M, Q - h), rtol=1e-10)


@each_body
def test_accelerations_satisfy_lagranges_equations(name):
    """d/dt ∂T/∂v - ∂T/∂q = Q, with the program's own kinetic energy."""
    element, _ = BODIES[name]

    def sides(q, v, Q):
        a = element.acceleration(q, v, Q)
        momentum = jax.grad(element.kinetic_energy, 1)
        rate = jax.jvp(momentum, (q, v), (v, a))[1]
        return rate, jax.grad(element.kinetic_energy)(q, v), Q

    rate, gradient, Q = jax.jit(jax.vmap(sides))(*states())
    scale = np.max(np.abs(rate) + np.abs(gradient) + np.abs(Q))
    assert np.max(np.abs(rate - gradient - Q)) < 1e-12 * scale


@each_body
def test_energies_and_weight_are_the_points(name):
    element, (masses, points) = BODIES[name]
    g = np.array([0.3, -9.81, 1.7])
    q, v, _ = states()
    kinetic = jax.jit(jax.vmap(element.kinetic_energy))(q, v)
    height = jax.jit(jax.vmap(lambda q: element.height_energy(q, g)))(q)
    weight = jax.jit(jax.vmap(lambda q: element.weight(q, g)))(q)
    for i, (q, v) in enumerate(zip(*states()[:2])):
        np.testing.assert_allclose(kinetic[i], momenta(q, v, masses, points)[0], rtol=1e-12)
        # both are zero in the design position of an ideal part: no constant to allow for
        np.testing.assert_allclose(height[i], -masses @ place(q, points) @ g, atol=1e-12)
        virtual_work = np.einsum("n,nai,a->i", masses, point_jacobian(q, points), g)
        np.testing.assert_allclose(weight[i], virtual_work, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["turned rotor", "any body"])
def test_acceleration_differentiates_by_every_number(name):
    element, _ = BODIES[name]
    q, v, Q = (x[0] for x in states(1, seed=8))
    leaves, tree = jax.tree.flatten(element)
    sizes = np.cumsum([x.size for x in leaves])[:-1]
    flat = jnp.concatenate([*(x.ravel() for x in leaves), q, v, Q])

    def f(x):
        parts = jnp.split(x, [*sizes, x.size - 18, x.size - 12, x.size - 6])
        own = jax.tree.unflatten(tree, [p.reshape(l.shape) for p, l in zip(parts, leaves)])
        return own.acceleration(*parts[-3:])

    assert_derivatives_agree(f, flat, rtol=1e-8, step=1e-3)


# One free body through time: what must be conserved, and that turning the start turns the run.


@eqx.filter_jit
def _tumble(machine, q, v):
    run = jr.simulate(machine, 3.0, 10.0, initial=jr.State(q[None], v[None]), **TIGHT)["body"]
    return run.position, run.velocity, run.acceleration


def tumbling(element, q, v):
    return map(np.asarray, _tumble(jr.Machine({"body": element}, {}), q, v))


START = np.array([0.1, -0.2, 0.3, 0.2, -0.3, 0.4]), np.array([0.3, 0.1, -0.2, 0.2, -0.3, 4.0])


@pytest.mark.parametrize("name", ["turned rotor", "any body"])
def test_free_body_keeps_energy_and_both_momenta(name):
    """CPL-05, first line; and its last along the run: e and gamma are an unbalance of points."""
    element, points = BODIES[name]
    run = tuple(tumbling(element, *START))
    q, v, _ = run
    assert np.ptp(q[:, 3]) > 0.3 and np.ptp(q[:, 5]) > 9  # it does tumble
    for kept in zip(*(momenta(q, v, *points) for q, v in zip(q, v))):
        kept = np.array(kept)
        assert np.max(np.abs(kept - kept[0])) < 1e-10 * np.max(np.abs(kept[0]))
    for q, v, a in zip(*run):
        M, h = newton(q, v, *points)
        assert np.max(np.abs(M @ a + h)) < 1e-12 * np.max(np.abs(M) @ np.abs(a) + np.abs(h))


@pytest.mark.parametrize("angle", [0.7, np.pi / 2, -2.0])
def test_turning_the_start_turns_the_run(angle):
    """CPL-05, fourth line; a free unbalanced rotor, any size of tilt."""
    element, _ = BODIES["turned rotor"]
    about_z = Rotation.from_euler("z", angle).as_matrix()

    def attitude(q):
        return Rotation.from_euler("XYZ", q[..., 3:]).as_matrix()

    q, v = START
    other = Rotation.from_matrix(about_z @ attitude(q)).as_euler("XYZ")
    q2 = np.concatenate([about_z @ q[:3], other])
    rates = np.linalg.solve(axes(q2), about_z @ axes(q) @ v[3:])
    one, *_ = tumbling(element, q, v)
    two, *_ = tumbling(element, q2, np.concatenate([about_z @ v[:3], rates]))
    assert np.ptp(one[:, 3]) > 0.3
    np.testing.assert_allclose(two[:, :3], one[:, :3] @ about_z.T, atol=1e-10)
    np.testing.assert_allclose(attitude(two), about_z @ attitude(one), atol=1e-10)


def test_a_body_that_tips_over_theta_says_so():
    """Free bodies have a closed form: the body spins about its axis, which goes round the angular momentum.
    Through a right angle of theta long steps end in no numbers, short ones come with a warning; both say
    where. Some way off it is right."""
    jp, jt = 0.02, 0.012
    machine = jr.Machine({"top": jr.Rotor(1.0, jp, jt)}, {}, fixed={"top": ("x", "y", "z")})

    def attitude_error(spin, sway, step=1e-3):
        v = np.array([[0, 0, 0, sway, 20.0, spin]])
        run = jr.simulate(machine, 0.1, 1000.0, jr.State(np.zeros((1, 6)), v), step=step)
        momentum = np.array([jt * sway, jt * 20.0, jp * spin])
        exact = Rotation.from_rotvec(0.1 * momentum / jt)
        exact = exact * Rotation.from_euler("z", 0.1 * spin * (1 - jp / jt))
        found = Rotation.from_euler("XYZ", np.asarray(run["top"].position)[-1, 3:])
        return (exact.inv() * found).magnitude()

    reached = r"theta of `top` had come to 90 degrees at t = 0\.07"
    with pytest.raises(jr.SimulationFailed, match=reached):
        attitude_error(0.5, 0.01)
    with pytest.warns(UserWarning, match=r"`top`: theta reaches 90 degrees at t = 0\.07"):
        assert attitude_error(0.5, 0.01, 5e-4) < 1e-3
    assert attitude_error(5.0, 0.1) < 1e-5  # 0.39 rad off: no word


# From dimensions


def test_a_rotor_from_its_dimensions():
    """The disc of ROSS's documentation (`DiskElement.from_geometry`): 280 x 50 x 70 mm, 7810 kg/m³; and the
    figures' derivatives by the diameter of a solid one, rho pi L (D/2, D³/8, D³/16 + L² D/24)."""
    disc = jr.Rotor.from_dimensions(0.28, 0.07, 7810.0, bore=0.05, ends=(0.035, 0.035))
    figures = [float(x) for x in (disc.mass, disc.polar_inertia, disc.transverse_inertia)]
    np.testing.assert_allclose(figures, [32.589727653, 0.32956362, 0.17808928], rtol=3e-8)
    assert disc.ends.tolist() == [0.035, 0.035]

    def solid(d):
        rotor = jr.Rotor.from_dimensions(d, 0.4, jr.STEEL, unbalance=jr.Unbalance(1e-5))
        return jnp.stack([rotor.mass, rotor.polar_inertia, rotor.transverse_inertia])

    D, L = 0.3, 0.4
    want = 7850 * np.pi * L * np.array([D / 2, D**3 / 8, D**3 / 16 + L**2 * D / 24])
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(solid)(D), want, rtol=1e-14)
    np.testing.assert_allclose(jax.vmap(solid)(jnp.array([D, 0.1]))[0], solid(D), rtol=1e-14)


def test_a_weighed_mass_that_is_not_that_of_the_dimensions_is_told():
    """A disc of 0.3 x 0.05 m of 7850 kg/m³ has 27.744 kg."""
    with pytest.warns(UserWarning, match=r"mass, 25 kg, is off by -10 % from the 27\.7442 kg"):
        light = jr.Rotor.from_dimensions(0.3, 0.05, jr.STEEL, mass=25.0)
    np.testing.assert_allclose(
        [light.mass, light.polar_inertia, light.transverse_inertia],
        [25.0, 25 * 0.09 / 8, 25 * (0.09 / 16 + 0.0025 / 12)],
        rtol=1e-15,
    )
    jr.Rotor.from_dimensions(0.3, 0.05, jr.STEEL, mass=27.0)  # 2.7 %: warnings are errors here
