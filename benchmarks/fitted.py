"""The paper's start-up by the exponentially fitted Adams method, one evaluation a step, on equations
written by hand: what jaxrotor's own solver reaches but for its field.

Nothing but the method's bare loop (`jaxrotor.integrators.fitted`) stands between XLA and the equations
(handwritten.py). Each row is run with XLA's own choice and with one kernel for each loop, in a process of its
own, beside CVODE and SciPy's LSODA, all on one core, in processor
seconds, taking turns. The gradient is that of main's mean square deflection over 1 s by every figure of the
equations, through the linearisation and its weights too; it is checked against central differences.

    python benchmarks/fitted.py [reference.npz]
"""

import argparse
import json
import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import handwritten
import jax.numpy as jnp
import numpy as np
from by_hand import QUICK, SAMPLE, constants, method
from machine import header
from record import record
from solvers import cvode, lsoda

from jaxrotor.integrators.fitted_weights import first_steps

REFERENCE = Path(__file__).parents[2] / "shared/reference/two_rotor_startup_reference.npz"
T_END, GRADIENT_END = 10.0, 1.0  # s
TIMES = np.linspace(0.0, T_END, 10_001)
ORDERS_AND_STEPS = ((6, 3), (6, 2), (6, 1), (5, 3), (5, 2), (5, 1), (4, 2))  # steps in a sample
REPEATS = 3
SINGLE = "--xla_cpu_multi_thread_eigen=false"
# (without a word of it `import jaxrotor` asks for one kernel)
XLAS_OWN = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1024"
ONE_KERNEL = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000000"


def seconds(call):
    begun = time.process_time()
    found = jax.block_until_ready(call())
    return found, time.process_time() - begun


def fitted_rows():
    """(name, call, what is known of it)."""
    p = constants()
    fixed = {k: np.asarray(v) for k, v in handwritten.FIGURES.items()}
    for order, substeps in ORDERS_AND_STEPS:
        prepare, run = method(order, substeps, T_END)
        prepare = jax.jit(prepare, compiler_options=QUICK)
        ladder, first = seconds(partial(prepare, p))
        _, preparing = seconds(partial(prepare, p))
        known = dict(
            prepare_compile=first - preparing,
            prepare=preparing,
            evaluations=round(T_END / SAMPLE * substeps) + first_steps(order).ends.size,
        )
        march = jax.jit(partial(run, fixed))
        yield f"fitted {order}, h = 1/{substeps} ms", partial(march, ladder), known


def peer_rows():
    for rtol in (1e-5, 1e-6, 1e-7, 1e-8):
        yield f"CVODE, numba, rtol {rtol:.0e}", cvode(rtol), {}
    for rtol in (1e-6, 1e-8):
        yield f"LSODA, numba, rtol {rtol:.0e}", lsoda(rtol), {}


def gradient_rows():
    """Of 1 s: the run, and its reverse gradient by one figure that the linearisation does not know and by
    all figures, through the linearisation and its weights; and how far that is from central differences."""
    prepare, run = method(6, 2, GRADIENT_END)
    p = constants()

    def cost(p):
        return jnp.mean(run(p, prepare(p)) ** 2) * 1e6

    ladder = jax.jit(prepare, compiler_options=QUICK)(p)
    calls = dict(
        run=jax.jit(lambda p: jnp.mean(run(p, ladder) ** 2)),
        unbalance=jax.jit(jax.grad(lambda p: jnp.mean(run(p, ladder) ** 2))),
        prepared=jax.jit(cost),
        all=jax.jit(jax.grad(cost)),
    )
    times, results = {}, {}
    for name, call in calls.items():
        results[name], first = seconds(lambda call=call: call(p))
        best = min(seconds(lambda call=call: call(p))[1] for _ in range(REPEATS))
        times[name] = dict(run=best, compile=first - best)
    off = 0.0
    for name, index in (("e", (1,)), ("m", (1,)), ("Jp", (1,)), ("pull", (1, 1))):
        step = 1e-5 * p[name][index]
        ends = [calls["prepared"]({**p, name: p[name].at[index].add(s * step)}) for s in (1, -1)]
        central = (ends[0] - ends[1]) / (2 * step)
        off = max(off, abs(float(results["all"][name][index] / central - 1)))
    return dict(times=times, off=off)


def child(reference):
    rows = [*fitted_rows(), *peer_rows()]
    first, best, paths = [], [np.inf] * len(rows), []
    for _, call, _ in rows:
        path, spent = seconds(call)
        first.append(spent)
        paths.append(np.asarray(path))
    for _ in range(REPEATS):
        for i, (_, call, _) in enumerate(rows):
            best[i] = min(best[i], seconds(call)[1])
    table = [
        dict(
            name=name,
            compile=a - b,
            run=b,
            error=float(np.hypot(*(x - reference).T).max()),
            **known,
        )
        for (name, _, known), a, b, x in zip(rows, first, best, paths)
    ]
    return dict(rows=table, gradient=gradient_rows())


def show(title, found):
    print(f"\n{title}")
    peers = [r for r in found["rows"] if r["name"].startswith("CVODE")]
    columns = (
        ("evaluations", 12),
        ("error m", 10),
        ("prepare s", 10),
        ("run s", 8),
        ("compile s", 10),
    )
    print(" " * 28 + "".join(f"{name:>{width}}" for name, width in (*columns, ("CVODE/run", 10))))
    for r in found["rows"]:
        compiling = r["compile"] + r.get("prepare_compile", 0.0)
        ratio = f"{at_error(peers, r['error']) / r['run']:.1f}" if peers else ""
        prepare = f"{r['prepare']:.3f}" if "prepare" in r else ""
        print(
            f"{r['name']:28}{r.get('evaluations', ''):>12}{r['error']:10.1e}{prepare:>10}{r['run']:8.3f}"
            f"{compiling:10.1f}{ratio:>10}"
        )
    words = dict(
        run="1 s", unbalance="1 s, gradient by unbalance", prepared="1 s, prepared anew",
        all="1 s, gradient by all figures",
    )  # fmt: skip
    for name, row in found["gradient"]["times"].items():
        print(f"{words[name]:28}{'':12}{'':10}{'':10}{row['run']:8.3f}{row['compile']:10.1f}")
    print(f"central differences agree with the gradient to {found['gradient']['off']:.0e}")


def at_error(rows, error):
    """Run time at that error: log-log between rows, those of the ends beyond them."""
    points = sorted((np.log(r["error"]), np.log(r["run"])) for r in rows)
    return float(np.exp(np.interp(np.log(error), *zip(*points))))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("reference", nargs="?", type=Path, default=REFERENCE)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.child:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, [max(os.sched_getaffinity(0))])
        with np.load(asked.reference) as data:
            main = list(data["stations"]).index("main")
            print(json.dumps(child(data["position"][:, main, :2])))
        return
    found = {}
    for title, flags in (
        ("XLA's own choice", f"{SINGLE} {XLAS_OWN}"),
        ("one kernel a loop", f"{SINGLE} {ONE_KERNEL}"),
    ):
        told = subprocess.run(
            [sys.executable, __file__, str(asked.reference), "--child"],
            check=True,
            stdout=subprocess.PIPE,
            env={**os.environ, "XLA_FLAGS": flags, "JAX_ENABLE_COMPILATION_CACHE": "false"},
        )
        found[title] = json.loads(told.stdout)
        show(title, found[title])
    one = found["one kernel a loop"]
    times = one["gradient"]["times"]
    rows = {r["name"]: r for r in one["rows"]}
    peers = [r for r in one["rows"] if r["name"].startswith("CVODE")]
    ratios = {
        "CVODE / by hand, order 6, h = 1/2 ms": at_error(
            peers, rows["fitted 6, h = 1/2 ms"]["error"]
        )
        / rows["fitted 6, h = 1/2 ms"]["run"],
        "4 runs / gradient by the unbalance": 4 * times["run"]["run"] / times["unbalance"]["run"],
    }
    record("fitted", header("numba", "scikit-sundae"), ratios, [found])


if __name__ == "__main__":
    main()
