"""What a run costs that is sampled finely: machines of configs/ at rising sample rates, by steps as planned,
which may span several samples, and by steps from sample to sample. Processor seconds of a later run, the best
of some in turn; the error is that of the worst coordinate at any sample, as part of its peak, against a much
shorter step, beside the run's own estimate.

    python benchmarks/sampling.py [--rates Hz ...] [config ...]
"""

import argparse
import dataclasses
import time
import warnings
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.machine.field import n_free
from jaxrotor.machine.system import assemble
from jaxrotor.simulation.run_error import share_of_peaks

CONFIGS = Path(__file__).parents[1] / "configs"
MACHINES = ("two_rotor_startup", "friswell_two_disc")
RATES = (1e3, 5e3, 20e3)  # Hz
REPEATS = 4
REFERENCE = 1 / 8e3  # s: longest step of a reference


def table(name: str, rate: float, t_end: float | None) -> None:
    study = jr.load(CONFIGS / f"{name}.toml")
    machine, own = study.machine, study.simulation
    simulation = dataclasses.replace(
        own, sample_rate=rate, t_end=t_end or own.t_end, step=None, tolerance=own.tolerance
    )
    plan = jr.plan(machine, simulation)
    simulation = dataclasses.replace(simulation, tolerance=None)

    def run(plan):
        return jr.simulate(machine, dataclasses.replace(simulation, step=plan), progress=False)

    plans = {"planned": plan, "by samples": plan.by_samples()}
    seconds = {key: [] for key in plans}
    runs = {}
    for _ in range(1 + REPEATS):
        for key, one in plans.items():
            begin = time.process_time()
            runs[key] = run(one)
            seconds[key].append(time.process_time() - begin)
    finest = dataclasses.replace(plan, span=1, substeps=max(1, round(1 / rate / REFERENCE)))
    exact = np.asarray(run(finest).y)
    n = n_free(assemble(machine))
    peak = np.abs(exact).max(axis=0)[:n]
    for key, one in plans.items():
        off = np.abs(np.asarray(runs[key].y) - exact).max(axis=0)[:n]
        error = float(share_of_peaks(jnp.asarray(off), jnp.asarray(peak), assemble(machine)))
        told = float(runs[key].stats["error"])
        print(
            f"| {name} | {rate:g} | {key} | {one.span}/{one.substeps} | {min(seconds[key][1:]):.3f} | "
            f"{error:.1e} | {told:.1e} |",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("config", nargs="*", default=MACHINES)
    parser.add_argument("--rates", type=float, nargs="+", default=RATES, help="Hz")
    parser.add_argument("--seconds", type=float, help="in place of the machine's own t_end")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    print(
        "| machine | Hz | steps | samples/steps | run s | error | estimate |\n|---|---|---|---|---|---|---|"
    )
    for name in asked.config:
        for rate in asked.rates:
            table(name, rate, asked.seconds)


if __name__ == "__main__":
    main()
