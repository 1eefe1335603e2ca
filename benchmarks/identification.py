"""Time to the same misfit: six unbalance parameters of the two-rotor machine from one noisy run-up.

jaxrotor's Levenberg-Marquardt on exact sensitivities, SciPy's least_squares with finite differences on
the same compiled simulation, and SciPy's with finite differences on CVODE (equations by hand, numba,
exact Jacobian). All start 20 % wrong, angles by 0.5 rad; the time is that until the cost is within 1e-4
of the least.

    python benchmarks/identification.py
"""

import sys
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import handwritten
import jax.numpy as jnp
import numpy as np
from machine import header
from record import record as keep
from scipy.optimize import least_squares
from sksundae.cvode import CVODE

sys.path.insert(0, str(Path(__file__).parent.parent / "experiments"))
from identify_unbalance import unknowns
from solvers import SCALE
from synthetic import RUN_UP, UNBALANCE, run_up, two_rotors

import jaxrotor as jr
from jaxrotor.identification.simulated import records

START = {p: v + 0.5 if "angle" in p else 1.2 * v for p, v in UNBALANCE.items()}
NEAR = 1e-4


class Watched:
    """A residual for SciPy that notes the time and the least cost so far at each call."""

    def __init__(self, residual):
        self.residual, self.log, self.began = residual, [], time.perf_counter()

    def __call__(self, x):
        r = self.residual(x)
        least = min([0.5 * r @ r, *(cost for _, cost in self.log[-1:])])
        self.log.append((time.perf_counter() - self.began, least))
        return r


def by_jaxrotor(sensed, record):
    """What was found, seconds to compile, seconds until the cost is near its least, iterations until then."""

    def go(iterations):
        began = time.perf_counter()
        stage = jr.Stage(jr.identification.Time(), iterations)
        found = jr.identify(
            two_rotors(START),
            unknowns(),
            sensed,
            jr.MeasuredRun(record),
            stages=[stage],
        )
        return found, time.perf_counter() - began

    found, first = go(20)
    found, whole = go(20)
    costs = found.histories["1: time"]
    near = int(np.argmax(costs <= (1 + NEAR) * costs[-1])) + 1
    # its covariance and its residual tests are in the time, as users wait for them too
    _, run = min((go(near) for _ in range(3)), key=lambda pair: pair[1])
    return found, first - whole, run, near


def on_simulation(found):
    """SciPy's residual on jaxrotor's compiled simulation."""
    problem = found.problem

    def residual(u):
        seen = records(problem.simulated, jnp.asarray(u))
        return np.concatenate([np.asarray(s.residual(x)) for s, x in zip(problem.signals, seen)])

    return residual


def on_cvode(found, rtol):
    """SciPy's residual on CVODE: accelerations of the housings and the tachometer from its states, flat
    (6, 4): x, y, z, psi, theta, phi of second, main, left and right, then their rates."""
    _, jac, unbalanced = handwritten.compiled()
    problem, space = found.problem, found.space
    rate = RUN_UP["rate"]
    t = np.arange(round(RUN_UP["end"] * rate) + 1) / rate
    s = np.minimum(t, handwritten.RAMP)
    ramp = 0.5 * handwritten.TOP_SPEED * (1 - np.cos(np.pi / handwritten.RAMP * s))
    weights = rtol * np.concatenate([SCALE, 1e3 * SCALE])
    figures = np.zeros((4, 2))
    row = {"eccentricity": 0, "angle": 1, "inclination": 2, "inclination_angle": 3}
    column = {"second": 0, "main": 1}
    linear = np.empty((48, 48))
    jac(0.0, np.zeros(48), None, linear)
    rates = np.empty((t.size, 48))

    def at_rest():
        y, out = np.zeros(48), np.empty(48)
        for _ in range(6):  # the rotors' weight is hardly nonlinear
            unbalanced(0.0, y, out, figures)
            y[:24] -= np.linalg.solve(linear[24:, :24], out[24:])
        return y

    def residual(u):
        for path, value in zip(space.paths, np.asarray(space.values(u))):
            part, _, name = path.split(".")
            figures[row[name], column[part]] = value
        solver = CVODE(
            lambda t, y, out: unbalanced(t, y, out, figures),
            jacfn=jac, rtol=rtol, atol=weights, method="BDF", max_num_steps=100_000,
        )  # fmt: skip
        y = np.asarray(solver.solve(t, at_rest()).y)
        for i in range(t.size):
            unbalanced(t[i], y[i], rates[i], figures)
        seen = (
            rates[:, 26],
            rates[:, 30],
            rates[:, 27],
            rates[:, 31],
            y[:, 44] + ramp + y[:, 36] * np.sin(y[:, 16]),
        )
        return np.concatenate(
            [(x - np.asarray(s.values)) / float(s.std) for s, x in zip(problem.signals, seen)]
        )

    return residual


def by_scipy(residual, n, step):
    """Least cost, seconds and simulations until it is near, after one call to compile."""
    residual(np.zeros(n))
    # SciPy's steps are parts of x: so it starts at 1
    watched = Watched(lambda x: residual(x - 1))
    fit = least_squares(watched, np.ones(n), method="lm", diff_step=step, xtol=1e-12, ftol=1e-10)
    for i, (at, cost) in enumerate(watched.log):
        if cost <= (1 + NEAR) * fit.cost:
            return fit, at, i + 1
    raise AssertionError


def main() -> None:
    print(machine := header("jaxlib", "optimistix", "scipy", "scikit-sundae", "numba"))
    ratios = {}
    sensed, record = run_up(0.05, 1)
    found, compiling, run, near = by_jaxrotor(sensed, record)
    n = len(found.paths)
    print("| method | simulations | run s | ratio | cost | parameters off, standard deviations |")
    print("|---|---|---|---|---|---|")
    print(
        f"| jaxrotor, exact sensitivities | {near} with {n} slopes | {run:.2f} | 1 | {found.cost:.1f} | |"
    )
    peers = (
        ("SciPy, differences, jaxrotor's simulation", on_simulation(found), 1e-6),
        ("SciPy, differences, CVODE at rtol 1e-8", on_cvode(found, 1e-8), 1e-4),
        ("SciPy, differences, CVODE at rtol 1e-6", on_cvode(found, 1e-6), 1e-3),
    )
    for name, residual, step in peers:
        fit, at, calls = by_scipy(residual, n, step)
        there, here = (found.space.shown(found.space.values(u)) for u in (fit.x - 1, found.u))
        away = np.max(np.abs(there - here) / list(found.std.values()))
        print(f"| {name} | {calls} | {at:.2f} | {at / run:.1f} | {fit.cost:.1f} | {away:.1e} |")
        ratios[f"{name} / jaxrotor"] = at / run
    print(f"compiling: {compiling:.0f} s", file=sys.stderr)
    keep("identification", machine, ratios, [("run s", run), ("compile s", compiling)])


if __name__ == "__main__":
    main()
