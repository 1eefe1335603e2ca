"""The solvers that startup.py compares, each as a call that gives main's path (x, y) at `TIMES`."""

import diffrax
import equinox as eqx
import figures
import handwritten
import jax
import jax.numpy as jnp
import numpy as np
from machine import two_rotors
from sksundae.cvode import CVODE

import jaxrotor as jr
from jaxrotor.integrators.weights import STAGES, adams_weights, extrapolation, runge_kutta_weights
from jaxrotor.machine.field import jacobian, vector_field
from jaxrotor.machine.system import assemble

T_END, SAMPLE = 10.0, 1e-3  # s
TIMES = np.linspace(0.0, T_END, 10_001)
LINEARISE_AT = 500.0  # rad/s


def simulate(solver=None, substeps=None):
    """jaxrotor's public interface; the step is its own choice unless `substeps` per sample are given."""
    step = {}
    if substeps is not None:
        unknown = float("nan")
        step = dict(step=jr.Plan(substeps, 6, LINEARISE_AT, figures.TOP_SPEED, unknown, unknown))

    def run():
        response = jr.simulate(
            two_rotors(),
            T_END,
            1 / SAMPLE,
            initial="undeformed",
            solver=solver,
            progress=False,
            **step,
        )
        return np.stack([response["main"].x, response["main"].y], axis=1)

    return run


def path_of_main(machine, ys):
    layout = assemble(machine).layout
    names = [machine.wiring.stations[m] for g in layout.stations for m in g.members]
    main = names.index("main")
    return ys[:, jnp.array([main, 4 + main])]


def diffrax_solve(solver, controller, t_end, max_steps, saveat):
    """jaxrotor's vector field by `diffrax.diffeqsolve`; the number of steps too, if asked for."""

    @eqx.filter_jit
    def run(machine):
        A = jacobian(assemble(machine, nominal=True), jnp.asarray(LINEARISE_AT))
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(vector_field), solver(A), 0.0, t_end, SAMPLE, jnp.zeros(48), assemble(machine),
            saveat=saveat, stepsize_controller=controller, max_steps=max_steps,
        )  # fmt: skip
        return path_of_main(machine, solution.ys), solution.stats["num_steps"]

    return lambda steps=False: run(two_rotors()) if steps else run(two_rotors())[0]


def handwritten_scan(order=6, substeps=4, start=2, refinement=4):
    """A minimal exponential Adams method: one scan, nothing that this machine does not need.

    The first `start` samples are made by Krogstad's ETD4RK in steps `refinement` times shorter.
    """
    f = handwritten.field()
    h = SAMPLE / substeps
    A = jnp.asarray(figures.jacobian(LINEARISE_AT))
    ahead = extrapolation(order)

    @jax.jit
    def run(t0):
        w, s = adams_weights(A, h, order), runge_kutta_weights(A, h / refinement)

        def N(t, y):
            return f(t, y) - A @ y

        def fine(y, t):
            k = h / refinement
            stages = jnp.zeros((5, 48)).at[0].set(y)
            for i, at in enumerate(STAGES):
                stages = stages.at[i + 1].set(N(t + at * k, s[i] @ stages.ravel()))
            y = s[4] @ stages.ravel()
            return y, y

        t = t0 + h / refinement * jnp.arange(start * substeps * refinement)
        _, short = jax.lax.scan(fine, jnp.zeros(48), t)
        first = jnp.concatenate([jnp.zeros((1, 48)), short[refinement - 1 :: refinement]])
        at = t0 + h * jnp.arange(first.shape[0] - order, first.shape[0])
        history = jax.vmap(N)(at, first[-order:])[::-1].ravel()

        def one(carry, i, t):
            y, history = carry
            t = t + (i + 1) * h
            predicted = w.predict @ jnp.concatenate([y, history])
            y = predicted + w.correct @ (N(t, predicted) - ahead @ history.reshape(order, 48))
            return y, jnp.concatenate([N(t, y), history[:-48]])

        def sample(carry, t):
            carry = jax.lax.scan(lambda c, i: (one(c, i, t), None), carry, jnp.arange(substeps))[0]
            return carry, carry[0][jnp.array([1, 5])]

        _, rest = jax.lax.scan(sample, (first[-1], history), jnp.asarray(TIMES[start:-1]))
        return jnp.concatenate([first[::substeps, jnp.array([1, 5])], rest])

    return lambda: run(0.0)


SCALE = np.repeat([1e-3, 1e-3, 1e-6, 1e-2, 1e-2, 1e-2], 4)  # m, rad: peaks of the coordinates


def cvode(rtol, atol=1.0, **options):
    """SUNDIALS CVODE, BDF; `atol` in units of rtol times each coordinate's size."""
    rhs, jac, _ = handwritten.compiled()
    weights = atol * rtol * np.concatenate([SCALE, 1e3 * SCALE])
    solver = CVODE(
        rhs, jacfn=jac, rtol=rtol, atol=weights, method="BDF", max_num_steps=100_000, **options
    )

    def run():
        solution = solver.solve(TIMES, np.zeros(48))
        assert solution.success, solution.message
        return solution.y[:, [1, 5]]

    return run
