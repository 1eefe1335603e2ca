"""The paper's start-up, 10 s recorded at 1 kHz: jaxrotor beside other solvers.

Every method integrates the same machine (machine.py, handwritten.py) from rest, undeformed. Its
error is the largest distance of main's centre from the reference solution's. CVODE and LSODA are given their
best: equations compiled by numba, the exact Jacobian of the line at its present speed, tolerances weighed by
each coordinate's size. `at 1e-6 m` and `at 1e-8 m` compare run times at equal error: interpolated (log-log)
between a method's rows; where all are more accurate, the quickest row as it is. One core, processor seconds.

    python benchmarks/startup.py [--short] [reference.npz]
"""

import argparse
import os
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import diffrax  # noqa: E402
import numpy as np  # noqa: E402
from machine import header  # noqa: E402
from record import record  # noqa: E402
from solvers import (  # noqa: E402
    T_END,
    TIMES,
    by_hand,
    cvode,
    diffrax_solve,
    gradsolve,
    lsoda,
    simulate,
)

import jaxrotor  # noqa: E402

REFERENCE = Path(__file__).parents[2] / "shared/reference/two_rotor_startup_reference.npz"
TARGETS = (1e-6, 1e-8)  # m: run times are compared at these errors
REPEATS = 5
IMPLICIT_END = 0.3  # s, all that implicit Runge-Kutta and Rosenbrock methods are asked for
OURS = "jaxrotor"
STEPS = (1, 2, 3, 4)  # in a sample


def methods():
    """(method, setting, call) in the order of the table."""
    yield "jaxrotor, own choice", "defaults", simulate()
    for n in STEPS:
        yield OURS, f"h = 1/{n} ms", simulate(None, n)
    for n in STEPS:
        yield "the same by hand", f"h = 1/{n} ms", by_hand(substeps=n)
    yield "jaxrotor ETD4RK", "h = 1/4 ms", simulate(jaxrotor.ETD4RK(), 4)
    for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        yield "CVODE BDF, numba", f"rtol {rtol:.0e}", cvode(rtol)
    for rtol in (1e-5, 1e-6, 1e-7, 1e-8):
        yield "LSODA, numba", f"rtol {rtol:.0e}", lsoda(rtol)


def measure(calls):
    """Of each: result, compile s (first call less the best later one), best run s. They take turns,
    so that a busy moment of the computer spoils one round of all rather than all rounds of one."""
    seconds = [[] for _ in calls]
    results = [None] * len(calls)
    for _ in range(1 + REPEATS):
        for i, call in enumerate(calls):
            start = time.process_time()
            results[i] = jax.block_until_ready(call())
            seconds[i].append(time.process_time() - start)
    return [(out, s[0] - min(s[1:]), min(s[1:])) for out, s in zip(results, seconds)]


def error_of(path, reference):
    """Largest distance from the reference, m; NaN without one."""
    if reference is None:
        return np.nan
    path = np.asarray(path)[: TIMES.size]
    return np.hypot(*(path - reference).T).max()


def at_target(rows, target):
    """Run time at the target error; NaN where no row reaches it."""
    points = sorted((error, run) for error, run in rows)
    error, run = np.log(np.array(points)).T
    if not error[0] <= np.log(target):
        return np.nan
    quick = np.minimum.accumulate(run)  # a row that is worse in both counts for nothing
    return float(np.exp(np.interp(np.log(target), error, quick)))


def load(path):
    """main's (x, y) in the reference solution, or None."""
    if not path.exists():
        print(f"No reference solution at {path}: errors are left out.")
        return None
    with np.load(path) as data:
        main = list(data["stations"]).index("main")
        return data["position"][:, main, :2]


def implicit_rows():
    """Far from the others: only a part of the run, and scaled. (name, seconds of 10 s, words)"""
    for name, rtol in (("gradsolve", 1e-6), ("diffrax Kvaerno5", 1e-6)):
        if name == "gradsolve":
            call = gradsolve(IMPLICIT_END, rtol)
        else:
            call = diffrax_solve(
                lambda A: diffrax.Kvaerno5(),
                diffrax.PIDController(rtol=rtol, atol=1e-3 * rtol),
                IMPLICIT_END,
                100_000,
                diffrax.SaveAt(t1=True),
            )
        call()
        start = time.process_time()
        jax.block_until_ready(call())
        run = time.process_time() - start
        engine = f", its engine {call()[1]}" if name == "gradsolve" else ""
        words = f"rtol {rtol:.0e}{engine}; scaled from the first {IMPLICIT_END} s, later steps are shorter"
        yield name, run * T_END / IMPLICIT_END, words


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("reference", nargs="?", type=Path, default=REFERENCE)
    parser.add_argument("--short", action="store_true", help="without those that take minutes")
    asked = parser.parse_args()
    reference = load(asked.reference)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, [max(os.sched_getaffinity(0))])
    print(machine := header("diffrax", "equinox", "numba", "scikit-sundae", "gradsolve"))

    listed = list(methods())
    table = [
        (method, setting, compiling, run, error_of(path, reference))
        for (method, setting, _), (path, compiling, run) in zip(
            listed, measure([m[2] for m in listed])
        )
    ]

    names = list(dict.fromkeys(row[0] for row in table))
    times = {
        (n, target): at_target([(e, r) for m, _, _, r, e in table if m == n], target)
        for n in names
        for target in TARGETS
    }
    heads = "".join(f"{f'at {target:.0e} m':>12}" for target in TARGETS)
    print(f"\n{'method':24}{'setting':14}{'compile s':>10}{'run s':>8}{'error m':>10}{heads}")
    for i, (method, setting, compiling, run, error) in enumerate(table):
        last = i + 1 == len(table) or table[i + 1][0] != method
        known = last and reference is not None
        shares = [times[method, t] / times[OURS, t] if known else np.nan for t in TARGETS]
        shown = "".join(f"{f'{x:.2f}' if np.isfinite(x) else '':>12}" for x in shares)
        error = f"{error:.1e}" if reference is not None else "-"
        print(f"{method:24}{setting:14}{compiling:10.2f}{run:8.3f}{error:>10}{shown}")
    ratios = {
        f"{n} / jaxrotor at {t:.0e} m": times[n, t] / times[OURS, t]
        for n in names
        for t in TARGETS
        if n != OURS and np.isfinite(times[n, t])
    }
    for name, seconds, words in () if asked.short else implicit_rows():
        share = seconds / times[OURS, TARGETS[0]]
        print(f"{name:24}{'':14}{'':10}{seconds:8.1f}{'':10}{share:12.0f}   ({words})")
        ratios[f"{name} / jaxrotor at 1e-06 m"] = share
    record("startup", machine, ratios, table)


if __name__ == "__main__":
    main()
