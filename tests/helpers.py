"""What several test files share: an independent body, total forces, three ways to differentiate."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

# Arguments of `jr.simulate` for runs that are not stiff and must be right to 1e-12 or so.
TIGHT = dict(solver=diffrax.Dopri8(), rtol=1e-13, atol=1e-15)


# A rigid body as points: the oracle of everything in `inertia`. Rotations by quaternions here.


def turn(axis, angle, a):
    """`a` (..., 3) turned about a coordinate axis, by quaternion algebra."""
    u = jnp.zeros(3).at[axis].set(jnp.sin(angle / 2))
    return a + 2 * jnp.cross(u, jnp.cross(u, a) + jnp.cos(angle / 2) * a)


def place(q, points):
    """Where the points (n, 3) of a body are when its station has the coordinates `q`."""
    turned = turn(0, q[3], turn(1, q[4], turn(2, q[5], points)))
    return q[:3] + turned


def cloud(mass, tensor, mass_centre):
    """Six point masses (masses, points) with this mass, centre and tensor about that centre."""
    spread, axes = np.linalg.eigh(np.trace(tensor) / 2 * np.eye(3) - tensor)
    arms = axes * np.sqrt(3 * np.maximum(spread, 0) / mass)
    points = np.concatenate([arms.T, -arms.T]) + mass_centre
    return np.full(6, mass / 6), points


def unbalanced_cloud(mass, polar, transverse, e=0.0, angle=0.0, gamma=0.0, gamma_angle=0.0):
    """An unbalanced rotor as points, from the words of physics.md: the principal axis turned by
    gamma about the in-plane axis at gamma_angle, the mass centre e away at `angle`."""
    in_plane = np.array([np.cos(gamma_angle), np.sin(gamma_angle), 0])
    tilt = Rotation.from_rotvec(gamma * in_plane).as_matrix()
    tensor = tilt @ np.diag([transverse, transverse, polar]) @ tilt.T
    return cloud(mass, tensor, e * np.array([np.cos(angle), np.sin(angle), 0]))


def kinetic(q, v, masses, points):
    _, rates = jax.jvp(lambda q: place(q, points), (q,), (v,))
    return 0.5 * jnp.sum(masses[:, None] * rates**2)


def lagrange(q, v, masses, points):
    """M and h of `M a + h = Q` for the points, from Lagrange's equations."""

    def momentum(q, v):
        return jax.grad(kinetic, 1)(q, v, masses, points)

    M = jax.jacfwd(momentum, 1)(q, v)
    h = jax.jvp(momentum, (q, v), (v, jnp.zeros(6)))[1] - jax.grad(kinetic)(q, v, masses, points)
    return M, h


def momenta(q, v, masses, points):
    """Linear and angular momentum (about the origin) of the points."""
    at, rates = jax.jvp(lambda q: place(q, points), (q,), (v,))
    return masses @ rates, masses @ jnp.cross(at, rates)


# Forces


def pull(element, *motions, t=0.0, state=None):
    """Everything that an element exerts, one row of six for each of its ends."""
    total = np.zeros((len(motions), 6))
    if hasattr(element, "matrices"):
        K, C = element.matrices()
        q, v = (np.concatenate([m[i] for m in motions]) for i in (0, 1))
        total -= np.reshape(K @ q + C @ v, total.shape)
    if hasattr(element, "forces"):
        own = element.forces(jnp.asarray(t), motions, state)
        total += 0 if own is None else np.stack(own)
    return total


# Derivatives


def assert_derivatives_agree(f, x, rtol=1e-7, step=1e-6, atol=0.0):
    """Forward, reverse and central differences of `f` (any shape) at the vector `x`."""
    x = jnp.asarray(x, float)
    f = jax.jit(f)
    forward, reverse = jax.jit(jax.jacfwd(f))(x), jax.jit(jax.jacrev(f))(x)
    assert np.all(np.isfinite(forward)) and np.any(np.abs(forward) > 0)
    scale = np.max(np.abs(forward))
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-11 * scale)
    for i in range(x.size):
        h = step * max(1e-3, abs(float(x[i])))
        d = jnp.zeros(x.size).at[i].set(h)
        central = (8 * (f(x + d) - f(x - d)) - (f(x + 2 * d) - f(x - 2 * d))) / (12 * h)
        np.testing.assert_allclose(
            np.asarray(forward)[..., i], central, rtol=rtol, atol=atol or rtol * scale
        )
    return forward
