"""Throughput of sweeps: the paper's start-up (10 s recorded at 1 kHz) many times over, its unbalance varied.

Single runs in a loop, batches of 16 to 1024 by `jr.sweep` on one and on two devices of the processor, and
beside them CVODE (BDF, equations compiled by numba, exact Jacobian; benchmarks/solvers.py) in a pool of one
process for each core, at its tolerance of like error (see startup.py). Each row is measured in a process of
its own, whose largest memory is told; compiling and running apart, the best of three.

    python benchmarks/sweep.py [--most 1024]
"""

import argparse
import multiprocessing
import os
import resource
import time

SUBSTEPS = 3  # a millisecond: 5e-9 m, as CVODE at 1e-6
RTOL = 1e-6
T_END, RATE = 10.0, 1000.0


def _memory() -> float:
    """GiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def batch(count: int, devices: int) -> tuple[float, float, float]:
    """Seconds to compile, seconds a member, GiB. One member runs by `simulate`, in a loop."""
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_num_cpu_devices", devices)
    import numpy as np
    from machine import two_rotors

    import jaxrotor as jr

    machine, path = two_rotors(), "main.unbalance.eccentricity"
    plan = jr.Plan(SUBSTEPS, 6, 500.0, 1000.0, float("nan"), float("nan"), 1, 96)
    peak = jr.objectives.PeakValue(jr.sensors.Radial("main"))
    if count == 1:

        def run():
            for e in np.linspace(1e-4, 5e-4, 8):
                response = jr.simulate(
                    machine.set({path: e}), T_END, RATE, "undeformed", step=plan, progress=False
                )
                float(peak(response))

        members = 8
    else:

        def run():
            jr.sweep(
                machine, {path: np.linspace(1e-4, 5e-4, count)}, {"peak": peak}, t_end=T_END,
                sample_rate=RATE, initial="undeformed", step=plan, chunk=count, progress=False,
            )  # fmt: skip

        members = count
    seconds = []
    for _ in range(4 if count < 512 else 2):
        began = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - began)
    best = min(seconds[1:])
    return seconds[0] - best, best / members, _memory()


def _pooled(count: int) -> float:
    from solvers import cvode

    run = cvode(RTOL)
    run()
    began = time.perf_counter()
    for _ in range(count):
        run()
    return time.perf_counter() - began


def pool(count: int) -> tuple[float, float, float]:
    """CVODE: a process for each core, each with its own compiled equations."""
    cores = os.cpu_count() or 1
    with multiprocessing.get_context("spawn").Pool(cores) as workers:
        seconds = workers.map(_pooled, [count] * cores)
    return float("nan"), max(seconds) / (count * cores), float("nan")


def apart(f, *arguments):
    with multiprocessing.get_context("spawn").Pool(1) as one:
        return one.apply(f, arguments)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--most", type=int, default=1024, help="the largest batch (default: 1024)")
    most = parser.parse_args().most
    from machine import header
    from record import record

    print(machine := header("diffrax", "numba", "scikit-sundae"))
    rows = [("CVODE, a process for each core", pool(8))]
    rows.append(("single runs in a loop", apart(batch, 1, 1)))
    for devices in (1, 2):
        for count in (16, 64, 256, 1024):
            if count <= most:
                words = f"batch of {count}, {devices} device{'s' * (devices > 1)}"
                rows.append((words, apart(batch, count, devices)))
    pooled, single = rows[0][1][1], rows[1][1][1]
    print(
        f"\n{'':34}{'compile s':>10}{'ms a run':>10}{'CVODE/own':>11}{'single/own':>12}{'GiB':>7}"
    )
    for name, (compiling, run, memory) in rows:
        ratios = f"{pooled / run:11.2f}{single / run:12.2f}"
        print(f"{name:34}{compiling:10.1f}{1e3 * run:10.1f}{ratios}{memory:7.2f}")
    best = min(run for _, (_, run, _) in rows[2:])
    record("sweep", machine, {"CVODE's pool / best batch": pooled / best}, rows)


if __name__ == "__main__":
    main()
