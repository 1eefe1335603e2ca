"""The paper's machine by equations written for it (handwritten.py), stepped by the bare loop of jaxrotor's
method (`jaxrotor.integrators.fitted`)."""

import figures
import handwritten
import jax
import jax.numpy as jnp
import numpy as np

from jaxrotor.integrators.blocks import blocks_of
from jaxrotor.integrators.fitted import run_through
from jaxrotor.integrators.ladder import ladder_of, rung_speeds

# The preparation is run once.
QUICK = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}

SAMPLE = 1e-3  # s
MAIN = np.array([1, 5])  # rows of its x and y


def linear_part(p, speed):
    """The Jacobian of the balanced line at `speed`, as figures.py has it, of the figures `p`."""
    rotors = jnp.stack([p["m"]] * 3 + [p["Jt"]] * 2 + [p["Jp"]])
    inertia = jnp.concatenate([rotors, p["inertia"]], axis=1)
    A = jnp.concatenate([jnp.eye(24, 48, 24), p["pull"] / inertia.reshape(24, 1)])
    psi, theta = (24 + 4 * c + np.arange(2) for c in (figures.PSI, figures.THETA))
    gyro = speed * p["Jp"] / p["Jt"]
    return A.at[psi, theta].add(-gyro).at[theta, psi].add(gyro)


def method(order, substeps, t_end):
    """`prepare(p)` and `run(p, prepared)`, main's path at the samples, both to be compiled."""
    h = SAMPLE / substeps
    f = handwritten.field()
    speed_of = handwritten._drive(jnp.sin, jnp.cos, jnp.minimum, jnp.maximum)
    blocks = blocks_of(SAMPLE, round(t_end / SAMPLE), substeps, order, jnp.zeros(0))

    def prepare(p):
        speeds = rung_speeds(jnp.asarray(figures.TOP_SPEED))
        A = jax.vmap(lambda w: linear_part(p, w))(speeds)
        return ladder_of(speeds, A, jnp.asarray(h), order, 24, blocks)

    def run(p, ladder):
        def field(t, y):
            return f(t, y, p)

        def speed(t, y):
            return speed_of(t)[1]

        return run_through(
            field, ladder, blocks, speed, jnp.zeros(48), watch=lambda t, y: y[:, MAIN]
        ).kept

    return prepare, run


def constants():
    """A field whose figures may change is what the gradient needs; for the run they are constants."""
    return {k: jnp.asarray(v) for k, v in handwritten.FIGURES.items()}
