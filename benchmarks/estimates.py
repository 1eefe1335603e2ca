"""What a run says of its own error, beside what it is: machines of configs/ at several steps, against a much
shorter one; both as part of the worst coordinate's peak, as `jaxrotor.plan` counts it.

    python benchmarks/estimates.py [--steps n ...] [config ...]
"""

import argparse
import dataclasses
import warnings
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import numpy as np
from machine import header
from record import record

import jaxrotor as jr
from jaxrotor.machine.field import n_free
from jaxrotor.machine.system import assemble
from jaxrotor.simulation.run_error import share_of_peaks

CONFIGS = Path(__file__).parents[1] / "configs"
MACHINES = (
    "two_rotor_startup",
    "friswell_two_disc",
    "overhung_fan",
    "geared_train",
    "braking_through_critical",
    "cracked_shaft",
    "coupling_bench",
    "motor_coupling_pump",
    "engine_viscous_damper",
    "rolling_mill",
)
REFERENCE = 8  # times the steps of the finest


def table(name: str, steps: list[int]) -> list[dict]:
    study = jr.load(CONFIGS / f"{name}.toml")
    machine, simulation = study.machine, study.simulation
    plan = jr.simulate(machine, dataclasses.replace(simulation, step=None), progress=False).info
    chosen = jr.Plan(
        plan.substeps, 6, float(plan.linearised_at), float(plan.planned_top_speed), 0.0, float("nan"),
        plan.evaluations,
    )  # fmt: skip

    def run(n: int):
        step = dataclasses.replace(chosen, substeps=n)
        return jr.simulate(machine, dataclasses.replace(simulation, step=step), progress=False)

    steps = sorted({*steps, chosen.substeps})
    exact = np.asarray(run(REFERENCE * steps[-1]).y)
    n = n_free(assemble(machine))
    peak = np.abs(exact).max(axis=0)[:n]
    print(f"\n{name}: {exact.shape[1]} states, {chosen.evaluations} evaluations a step")
    rows = []
    for count in steps:
        try:
            response = run(count)
        except jr.SimulationFailed as failed:
            print(f"{count:4} steps a sample: {str(failed).partition(':')[0]}", flush=True)
            continue
        off = np.abs(np.asarray(response.y) - exact).max(axis=0)[:n]
        error = float(share_of_peaks(jnp.asarray(off), jnp.asarray(peak), assemble(machine)))
        told = float(response.stats["error"])
        mark = "  planned" if count == chosen.substeps else ""
        print(
            f"{count:4} steps a sample: error {error:.1e}, estimate {told:.1e}, "
            f"ratio {told / error:.2g}{mark}",
            flush=True,
        )
        planned = count == chosen.substeps
        rows.append(dict(machine=name, steps=count, error=error, told=told, planned=planned))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("config", nargs="*", default=MACHINES)
    parser.add_argument("--steps", type=int, nargs="+", default=[1, 2, 4], help="in a sample")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = [row for name in asked.config for row in table(name, asked.steps)]
    record("estimates", header(), {}, rows)


if __name__ == "__main__":
    main()
