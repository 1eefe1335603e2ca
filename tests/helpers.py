"""What several test files share: an independent body, total forces, three ways to differentiate."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import jaxrotor as jr
from jaxrotor.machine.field import jacobian
from jaxrotor.machine.system import assemble
from jaxrotor.simulation.run_info import RunInfo
from jaxrotor.simulation.state import to_flat

# Arguments of `jr.simulate` for runs that are not stiff and must be right to 1e-12 or so.
TIGHT = dict(solver=diffrax.Dopri8(), rtol=1e-13, atol=1e-15)


# A rigid body as points, in plain NumPy: the oracle of everything in `inertia`.


def axes(q):
    """Columns: the global axes about which psi', theta' and phi' turn."""
    first = Rotation.from_euler("x", q[3]).as_matrix()
    second = first @ Rotation.from_euler("y", q[4]).as_matrix()
    return np.stack([np.eye(3)[0], first[:, 1], second[:, 2]], axis=1)


def place(q, points):
    """Where the points (n, 3) of a body are when its station has the coordinates `q`."""
    return q[:3] + points @ Rotation.from_euler("XYZ", q[3:]).as_matrix().T


def point_jacobian(q, points):
    """∂place/∂q, (n, 3, 6)."""
    arms = place(q, points) - q[:3]
    turning = [np.cross(axis, arms) for axis in axes(q).T]
    shifting = np.broadcast_to(np.eye(3), (len(points), 3, 3))
    return np.concatenate([shifting, np.stack(turning, axis=-1)], axis=-1)


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


def newton(q, v, masses, points):
    """M and h of `M a + h = Q`, by virtual work of the points' masses times accelerations."""
    J = point_jacobian(q, points)
    arms, a = place(q, points) - q[:3], axes(q)
    w = a @ v[3:]
    carried = v[3] * a[:, 0], v[3] * a[:, 0] + v[4] * a[:, 1]  # what turns the 2nd and 3rd axis
    w_t = v[4] * np.cross(carried[0], a[:, 1]) + v[5] * np.cross(carried[1], a[:, 2])
    at_no_acceleration = np.cross(w_t, arms) + np.cross(w, np.cross(w, arms))
    M = np.einsum("n,nai,naj->ij", masses, J, J)
    return M, np.einsum("n,nai,na->i", masses, J, at_no_acceleration)


def momenta(q, v, masses, points):
    """Kinetic energy, linear momentum, and angular momentum about the origin."""
    rates = point_jacobian(q, points) @ v
    angular = masses @ np.cross(place(q, points), rates)
    return 0.5 * masses @ np.sum(rates**2, axis=1), masses @ rates, angular


# Machines


def at_instants(machine, q, v, t=0.0):
    """A response that consists of given states (stations, 6) or (nt, stations, 6): everything that
    can be asked of a run, without one."""
    t, q, v = jnp.atleast_1d(jnp.asarray(t, float)), jnp.asarray(q), jnp.asarray(v)
    if q.ndim == 2:
        q, v = q[None], v[None]

    @eqx.filter_jit
    @jax.vmap
    def flat(t, q, v):
        system = assemble(machine)
        return to_flat(jr.State(q, v), system, system.reference(t))

    return jr.Response(machine, t, flat(t, q, v), RunInfo("none"))


@eqx.filter_jit
def _jacobian(machine):
    return jacobian(assemble(machine), jnp.zeros(()))


def hertz(machine):
    """Natural frequencies at rest above 0.2 Hz, rising."""
    roots = np.linalg.eigvals(np.asarray(_jacobian(machine)))
    return np.sort(roots.imag[roots.imag > 1.0]) / (2 * np.pi)


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
    """Forward, reverse and central differences of `f` (any shape) at the vector `x`. (One direction after
    another: side by side, as of `jacfwd` and `jacrev`, their programs take a sixth longer to make.)"""
    x = np.asarray(x, float)

    @jax.jit
    def ahead(x, count):
        """The value, and so many of the columns."""
        like = jax.eval_shape(f, x)

        def along(i, found):
            value, slope = jax.jvp(f, (x,), (jnp.eye(x.size)[i],))
            return value, found[1].at[i].set(slope)

        none = jnp.zeros(like.shape), jnp.zeros((x.size, *like.shape))
        value, columns = jax.lax.fori_loop(0, count, along, none)
        return value, jnp.moveaxis(columns, 0, -1)

    @jax.jit
    def back(x):
        value, pulled = jax.vjp(f, x)
        if not value.ndim:
            return pulled(jnp.ones(()))[0]
        units = jnp.eye(value.size).reshape(-1, *value.shape)
        return jax.lax.map(lambda u: pulled(u)[0], units).reshape(*value.shape, x.size)

    def value(x):
        return np.asarray(ahead(x, 1)[0])

    forward, reverse = ahead(x, x.size)[1], back(x)
    forward = np.asarray(forward)
    assert np.all(np.isfinite(forward)) and np.any(np.abs(forward) > 0)
    scale = np.max(np.abs(forward))
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-11 * scale)
    for i in range(x.size):
        h = step * max(1e-3, abs(float(x[i])))
        d = np.zeros(x.size)  # NumPy's sums, for each of JAX's own would be compiled
        d[i] = h
        central = 8 * (value(x + d) - value(x - d)) - (value(x + 2 * d) - value(x - 2 * d))
        np.testing.assert_allclose(
            forward[..., i],
            central / (12 * h),
            rtol=rtol,
            atol=atol or rtol * scale,
        )
    return forward
