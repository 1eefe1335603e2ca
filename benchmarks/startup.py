"""The paper's start-up, 10 s recorded at 1 kHz: jaxrotor beside other solvers.

Every method integrates the same machine (machine.py, handwritten.py) from rest, undeformed. Its
error is the largest distance of main's centre from the reference solution's. CVODE is given its
best: equations compiled by numba, the exact Jacobian of the line at its present speed, tolerances
weighed by each coordinate's size. `at 1e-8 m` compares the run times at equal error: interpolated
(log-log) between a method's rows; where all are more accurate, the quickest row as it is.

    python benchmarks/startup.py [reference.npz]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import diffrax  # noqa: E402
import numpy as np  # noqa: E402
from machine import header  # noqa: E402
from solvers import (  # noqa: E402
    T_END,
    TIMES,
    cvode,
    diffrax_solve,
    handwritten_scan,
    simulate,
)

import jaxrotor  # noqa: E402

REFERENCE = Path(__file__).parents[2] / "shared/reference/two_rotor_startup_reference.npz"
TARGET = 1e-8  # m: run times are compared at this error
REPEATS = 5
IMPLICIT_END = 0.3  # s, all that the implicit Runge-Kutta method is asked for
OURS = "jaxrotor Adams 6"


def methods():
    """(method, setting, call) in the order of the table."""
    yield "jaxrotor, own choice", "defaults", simulate()
    for n in (3, 4):
        yield OURS, f"h = 1/{n} ms", simulate(None, n)
    for n in (3, 4, 8):
        yield "jaxrotor ETD4RK", f"h = 1/{n} ms", simulate(jaxrotor.ETD4RK(), n)
    for n in (3, 4):
        yield "hand-written Adams 6", f"h = 1/{n} ms", handwritten_scan(substeps=n)
    for n in (3, 4):
        yield (
            "diffeqsolve, Adams 6",
            f"h = 1/{n} ms",
            diffrax_solve(
                lambda A, n=n: jaxrotor.ExponentialAdams(6, n, A),
                diffrax.ConstantStepSize(),
                T_END,
                TIMES.size + 1,
                diffrax.SaveAt(t0=True, steps=True),
            ),
        )
    for rtol in (1e-5, 1e-6, 1e-7, 1e-8):
        yield "CVODE BDF, numba", f"rtol {rtol:.0e}", cvode(rtol)


def measure(calls):
    """Of each: result, compile s (first call less the best later one), best run s. They take turns,
    so that a busy moment of the computer spoils one round of all rather than all rounds of one."""
    seconds = [[] for _ in calls]
    results = [None] * len(calls)
    for _ in range(1 + REPEATS):
        for i, call in enumerate(calls):
            start = time.perf_counter()
            results[i] = jax.block_until_ready(call())
            seconds[i].append(time.perf_counter() - start)
    return [(out, s[0] - min(s[1:]), min(s[1:])) for out, s in zip(results, seconds)]


def error_of(path, reference):
    """Largest distance from the reference, m; NaN without one."""
    if reference is None:
        return np.nan
    path = np.asarray(path)[: TIMES.size]
    return np.hypot(*(path - reference).T).max()


def at_target(rows):
    """Run time at the target error; NaN where no row reaches it."""
    points = sorted((error, run) for error, run in rows)
    error, run = np.log(np.array(points)).T
    if not error[0] <= np.log(TARGET):
        return np.nan
    quick = np.minimum.accumulate(run)  # a row that is worse in both counts for nothing
    return float(np.exp(np.interp(np.log(TARGET), error, quick)))


def load(path):
    """main's (x, y) in the reference solution, or None."""
    if not path.exists():
        print(f"No reference solution at {path}: errors are left out.")
        return None
    with np.load(path) as data:
        main = list(data["stations"]).index("main")
        return data["position"][:, main, :2]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("reference", nargs="?", type=Path, default=REFERENCE)
    reference = load(parser.parse_args().reference)
    print(header("diffrax", "equinox", "numba", "scikit-sundae"))

    listed = list(methods())
    table = [
        (method, setting, compiling, run, error_of(path, reference))
        for (method, setting, _), (path, compiling, run) in zip(
            listed, measure([m[2] for m in listed])
        )
    ]

    names = list(dict.fromkeys(row[0] for row in table))
    times = {n: at_target([(e, r) for m, _, _, r, e in table if m == n]) for n in names}
    print(
        f"\n{'method':24}{'setting':14}{'compile s':>10}{'run s':>8}{'error m':>10}{'at 1e-8 m':>11}"
    )
    for i, (method, setting, compiling, run, error) in enumerate(table):
        last = i + 1 == len(table) or table[i + 1][0] != method
        ratio = f"{times[method] / times[OURS]:.2f}" if last and reference is not None else ""
        shown = f"{error:.1e}" if reference is not None else "-"
        print(f"{method:24}{setting:14}{compiling:10.2f}{run:8.3f}{shown:>10}{ratio:>11}")

    # far from the others: only a part of the run, and scaled
    implicit = diffrax_solve(
        lambda A: diffrax.Kvaerno5(),
        diffrax.PIDController(rtol=1e-6, atol=1e-9),
        IMPLICIT_END,
        100_000,
        diffrax.SaveAt(t1=True),
    )
    ((out, compiling, run),) = measure([lambda: implicit(True)])
    steps = int(out[1])
    print(
        f"{'diffrax Kvaerno5':24}{'rtol 1e-06':14}{compiling:10.2f}{run * T_END / IMPLICIT_END:8.1f}"
        f"{'-':>10}{run * T_END / IMPLICIT_END / times[OURS]:11.0f}\n    "
        f"(scaled from the first {IMPLICIT_END} s: {steps} steps in {run:.1f} s, "
        f"{1e3 * run / steps:.2f} ms each; later steps are shorter)"
    )


if __name__ == "__main__":
    main()
