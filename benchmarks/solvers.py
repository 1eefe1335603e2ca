"""The solvers that startup.py compares, each as a call that gives main's path (x, y) at `TIMES`."""

import diffrax
import equinox as eqx
import figures
import handwritten
import jax
import jax.numpy as jnp
import numpy as np
from by_hand import QUICK, SAMPLE, constants, method
from machine import two_rotors
from scipy.integrate import odeint
from sksundae.cvode import CVODE

import jaxrotor as jr
from jaxrotor.machine.field import jacobian, vector_field
from jaxrotor.machine.system import assemble

T_END = 10.0  # s
TIMES = np.linspace(0.0, T_END, 10_001)
LINEARISE_AT = 500.0  # rad/s


def simulate(solver=None, substeps=None):
    """jaxrotor's public interface; the step is its own choice unless `substeps` per sample are given."""
    step = {}
    if substeps is not None:
        unknown = float("nan")
        step = dict(
            step=jr.Plan(substeps, 6, LINEARISE_AT, figures.TOP_SPEED, unknown, unknown, 1, 96)
        )

    machine = two_rotors()

    def run():
        response = jr.simulate(
            machine,
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


def by_hand(order=6, substeps=2):
    """Equations written by hand for this machine, by the bare loop of jaxrotor's method."""
    prepare, run = method(order, substeps, T_END)
    prepare = jax.jit(prepare, compiler_options=QUICK)
    figures_ = {k: np.asarray(v) for k, v in handwritten.FIGURES.items()}
    march = jax.jit(lambda ladder: run(figures_, ladder))
    return lambda: march(prepare(constants()))


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


def lsoda(rtol):
    """SciPy's, of the same compiled equations and Jacobian, tolerances weighed by size."""
    rhs, jac, _ = handwritten.compiled()
    atol = rtol * np.concatenate([SCALE, 1e3 * SCALE])
    out, J = np.empty(48), np.empty((48, 48))

    def field(t, y):
        rhs(t, y, out)
        return out

    def jacobian(t, y):
        jac(t, y, out, J)
        return J

    def run():
        y = odeint(
            field,
            np.zeros(48),
            TIMES,
            Dfun=jacobian,
            rtol=rtol,
            atol=atol,
            tfirst=True,
            mxstep=10**6,
        )
        return y[:, [1, 5]]

    return run


class _Problem:
    """The machine as gradsolve takes one."""

    name, dim, is_stiff, t0 = "two_rotors", 48, True, 0.0

    def __init__(self, t_end):
        self.t1, self.system = t_end, assemble(two_rotors())

    def f_jax(self, t, y, p):
        return vector_field(jnp.asarray(t, float), y, self.system)


def gradsolve(t_end, rtol):
    """Its own choice of engine for a stiff system on a processor; the last state."""
    import gradsolve as gs

    problem = _Problem(t_end)

    def run():
        found = gs.solve(
            problem, np.zeros((1, 48)), np.zeros((1, 1)), rtol=rtol, atol=1e-3 * rtol, device="cpu"
        )
        return np.asarray(found.y_final)[0], found.solver

    return run
