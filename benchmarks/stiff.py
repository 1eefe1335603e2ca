"""Work and precision where forces stiffen: candidates for machines that are not smooth, on three of them.

Rodas5P (`jr.Rosenbrock`), Kvaerno5 of diffrax and an exponential method made linear anew at each step, beside
CVODE (BDF, where scikit-sundae is installed) and SciPy's LSODA and Radau with equations by hand, compiled by
numba. Each at three tolerances; the error is the largest of the path in the plane, over its size, against
Rodas5P at 1e-12 (which Radau at 1e-11 confirms). Compiling and running apart, in processor seconds, the
best of five. XLA makes one kernel of each loop, unless XLA_FLAGS are set.

    python benchmarks/stiff.py [rows that begin so ...]
"""

import os
import sys
import time

ONE_KERNEL = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000000"
os.environ.setdefault("XLA_FLAGS", ONE_KERNEL)

import diffrax
import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import numpy as np
from machine import header
from record import record
from relinearised import ExponentialRosenbrock
from scipy.integrate import odeint, solve_ivp
from stiff_equations import MACHINES

import jaxrotor as jr

try:
    from sksundae.cvode import CVODE
except ImportError:  # no wheel for this machine: the other peers remain
    CVODE = None

RATE = 5000.0
TOLERANCES = (1e-5, 1e-7, 1e-9)
SCALE = 1e-3  # absolute over relative tolerance: m, m/s


def ours(machine, start, t_end, solver, rtol):
    state = jr.State(jnp.zeros((1, 6)).at[0, :2].set(jnp.array(start)), jnp.zeros((1, 6)))

    def run():
        found = jr.simulate(
            machine, t_end, RATE, state, solver=solver, rtol=rtol, atol=SCALE * rtol, progress=False
        )
        return np.asarray(found["disc"].position[:, :2]), int(found.info.steps)

    return run


def cvode(field, start, t_end, rtol):
    times = np.arange(int(round(t_end * RATE)) + 1) / RATE
    solver = CVODE(field, rtol=rtol, atol=SCALE * rtol, max_num_steps=10**7)

    def run():
        found = solver.solve(times, np.array([*start, 0.0, 0.0]))
        return found.y[:, :2], found.nfev

    return run


def lsoda(field, start, t_end, rtol):
    times = np.arange(int(round(t_end * RATE)) + 1) / RATE
    dy = np.empty(4)

    def right(t, y):
        field(t, y, dy)
        return dy

    def run():
        start_ = [*start, 0.0, 0.0]
        found, told = odeint(
            right,
            start_,
            times,
            rtol=rtol,
            atol=SCALE * rtol,
            tfirst=True,
            full_output=True,
            mxstep=10**6,
        )
        return found[:, :2], told["nfe"][-1]

    return run


def radau(field, start, t_end, rtol):
    times = np.arange(int(round(t_end * RATE)) + 1) / RATE

    def right(t, y):
        dy = np.empty(4)
        field(t, y, dy)
        return dy

    def run():
        found = solve_ivp(
            right, (0, times[-1]), [*start, 0.0, 0.0], "Radau", times, rtol=rtol, atol=SCALE * rtol
        )
        return found.y[:2].T, found.nfev

    return run


def solvers(machine, field, start, t_end):
    """Words -> a maker of runs to a tolerance."""

    def by(solver):
        return lambda tol: ours(machine, start, t_end, solver, tol)

    rows = {
        "Rodas5P (jr.Rosenbrock)": by(jr.Rosenbrock()),
        "Kvaerno5": by(diffrax.Kvaerno5()),
        "exponential, linear anew": by(ExponentialRosenbrock()),
        "CVODE (BDF), numba": lambda tol: cvode(field, start, t_end, tol),
        "LSODA (odeint), numba": lambda tol: lsoda(field, start, t_end, tol),
        "SciPy Radau, numba": lambda tol: radau(field, start, t_end, tol),
    }
    if CVODE is None:
        del rows["CVODE (BDF), numba"]
    wanted = tuple(sys.argv[1:])
    return {words: make for words, make in rows.items() if not wanted or words.startswith(wanted)}


# s of runs, after which there are enough of them
LONG = 3.0


def main() -> None:
    machine_of = header("diffrax", "scipy", "numba", *(["scikit-sundae"] if CVODE else []))
    print(machine_of)
    table = []
    for name, (build, field, start, t_end) in MACHINES.items():
        machine = build()
        exact, _ = ours(machine, start, t_end, jr.Rosenbrock(), 1e-12)()
        confirmed, _ = radau(field, start, t_end, 1e-11)()
        size, count = np.max(np.abs(exact)), len(exact)
        off = np.max(np.abs(confirmed[:count] - exact)) / size
        print(f"\n{name}: {t_end:g} s; Radau at 1e-11 is {off:.0e} off")
        print(f"  {'':28}{'tolerance':>10}{'compile s':>11}{'run s':>9}{'error':>9}{'steps':>9}")
        for words, make in solvers(machine, field, start, t_end).items():
            for tol in TOLERANCES:
                run = make(tol)
                seconds = []
                for _ in range(6):
                    began = time.process_time()
                    found, steps = run()
                    seconds.append(time.process_time() - began)
                    if sum(seconds[1:]) > LONG:  # what is so slow need not be timed five times
                        break
                best = min(seconds[1:])
                error = np.max(np.abs(found[:count] - exact[: len(found)])) / size
                table.append((name, words, tol, best, float(error)))
                print(
                    f"  {words:28}{tol:10.0e}{seconds[0] - best:11.1f}{best:9.3f}{error:9.0e}{steps:9d}",
                    flush=True,
                )
    record("stiff", machine_of, dict(ratios(table)), table)


def ratios(table):
    """How many times as long CVODE takes as Rodas5P at equal error, at 1e-5 and 1e-7 of the path."""
    for name in MACHINES:
        for target in (1e-5, 1e-7):
            own, peer = (
                at_error(
                    [(e, s) for n, w, _, s, e in table if n == name and w.startswith(words)], target
                )
                for words in ("Rodas5P", "CVODE")
            )
            if own and peer:
                yield f"CVODE / Rodas5P, {name}, at {target:.0e}", peer / own


def at_error(rows, error):
    """Run time at that error: log-log between rows, and beyond them along the line through all."""
    if len(rows) < 2:
        return None
    x, y = np.log(np.array(sorted(rows))).T
    slope = np.polyfit(x, y, 1)
    inside = x[0] <= np.log(error) <= x[-1]
    return float(
        np.exp(np.interp(np.log(error), x, y) if inside else np.polyval(slope, np.log(error)))
    )


if __name__ == "__main__":
    main()
