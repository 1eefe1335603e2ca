"""Rotor, RigidBody: their equations against Lagrange's for a cloud of point masses.

The cloud shares no line with the program: rotations by quaternions, M and h by differentiating the
points' kinetic energy.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import (
    TIGHT,
    assert_derivatives_agree,
    cloud,
    kinetic,
    lagrange,
    momenta,
    place,
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
    return jnp.asarray(q), jnp.asarray(v), jnp.asarray(Q)


@each_body
def test_accelerations_satisfy_lagranges_equations(name):
    element, points = BODIES[name]
    q, v, Q = states()
    a = jax.jit(jax.vmap(element.acceleration))(q, v, Q)
    M, h = jax.jit(jax.vmap(lambda q, v: lagrange(q, v, *points)))(q, v)
    for i in range(len(q)):
        terms = np.abs(M[i]) @ np.abs(a[i]) + np.abs(h[i]) + np.abs(Q[i])
        np.testing.assert_array_less(np.abs(M[i] @ a[i] + h[i] - Q[i]), 1e-12 * terms.max())
        np.testing.assert_allclose(a[i], np.linalg.solve(M[i], Q[i] - h[i]), rtol=1e-10)


@each_body
def test_energies_and_weight_are_the_points(name):
    element, (masses, points) = BODIES[name]
    q, v, _ = states()
    g = jnp.array([0.3, -9.81, 1.7])

    def height(q):
        return -jnp.sum(masses[:, None] * place(q, points) * g)

    for q, v in zip(q, v):
        np.testing.assert_allclose(
            element.kinetic_energy(q, v), kinetic(q, v, masses, points), rtol=1e-12
        )
        # both are zero in the design position of an ideal part: no constant to allow for
        np.testing.assert_allclose(element.height_energy(q, g), height(q), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(
            element.weight(q, g), -jax.grad(height)(q), rtol=1e-12, atol=1e-12
        )


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


def tumbling(element, q, v):
    machine = jr.Machine({"body": element}, {})
    return jr.simulate(machine, 3.0, 10.0, initial=jr.State(q[None], v[None]), **TIGHT)["body"]


START = np.array([0.1, -0.2, 0.3, 0.2, -0.3, 0.4]), np.array([0.3, 0.1, -0.2, 0.2, -0.3, 4.0])


@pytest.mark.parametrize("name", ["unbalanced rotor", "any body"])
def test_free_body_keeps_energy_and_both_momenta(name):
    """CPL-05, first line."""
    element, points = BODIES[name]
    run = tumbling(element, *START)
    assert np.ptp(run.psi) > 0.3 and np.ptp(run.phi) > 9  # it does tumble
    E = jax.vmap(lambda q, v: kinetic(q, v, *points))(run.position, run.velocity)
    P, H = jax.vmap(lambda q, v: momenta(q, v, *points))(run.position, run.velocity)
    for kept in (E, P, H):
        assert np.max(np.abs(kept - kept[0])) < 1e-10 * np.max(np.abs(kept[0]))


def test_free_body_moves_as_its_points_do():
    """CPL-05, last line, along a run: unbalance set by e and gamma is unbalance of point masses."""
    element, points = BODIES["turned rotor"]
    run = tumbling(element, *START)
    M, h = jax.vmap(lambda q, v: lagrange(q, v, *points))(run.position, run.velocity)
    rest = np.einsum("tij,tj->ti", M, run.acceleration) + h
    assert np.max(np.abs(rest)) < 1e-12 * np.max(np.abs(h)) * 10  # sums of ten terms or so
    # the velocities are the positions' rates: a quadrature that is exact to O(dt^8) says the same
    same = jr.RigidBody(element.mass, element.tensor(), element.mass_centre())
    np.testing.assert_allclose(tumbling(same, *START).position, run.position, atol=1e-10)


@pytest.mark.parametrize("angle", [0.7, np.pi / 2, -2.0])
def test_turning_the_start_turns_the_run(angle):
    """CPL-05, fourth line; a free unbalanced rotor, any size of tilt."""
    element, _ = BODIES["unbalanced rotor"]
    about_z = Rotation.from_euler("z", angle).as_matrix()

    def axes(q):  # columns: the axes about which psi', theta' and phi' turn
        first = Rotation.from_euler("x", q[3]).as_matrix()
        second = first @ Rotation.from_euler("y", q[4]).as_matrix()
        return np.stack([np.eye(3)[0], first[:, 1], second[:, 2]], axis=1)

    q, v = START
    turned = about_z @ Rotation.from_euler("XYZ", q[3:]).as_matrix()
    q2 = np.concatenate([about_z @ q[:3], Rotation.from_matrix(turned).as_euler("XYZ")])
    spin = np.linalg.solve(axes(q2), about_z @ axes(q) @ v[3:])
    one, two = tumbling(element, q, v), tumbling(element, q2, np.r_[about_z @ v[:3], spin])
    np.testing.assert_allclose(
        two.position[:, :3], np.asarray(one.position)[:, :3] @ about_z.T, atol=1e-10
    )
    np.testing.assert_allclose(
        Rotation.from_euler("XYZ", np.asarray(two.position)[:, 3:]).as_matrix(),
        about_z @ Rotation.from_euler("XYZ", np.asarray(one.position)[:, 3:]).as_matrix(),
        atol=1e-10,
    )
