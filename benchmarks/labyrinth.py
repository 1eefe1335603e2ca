"""Coefficients of a labyrinth at twenty speeds, beside ROSS 3.1 (from 3.0 on it has labyrinths; it wants a
Python of its own). Prints a table; nothing is asserted (docs/benchmarks.md has a run of it).

    python benchmarks/labyrinth.py --peer PYTHON_WITH_ROSS_3
"""

import argparse
import json
import os
import subprocess
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

SPEEDS = np.linspace(200.0, 1150.0, 20)
# ROSS's own test seal, with a gas that stays at one temperature and small falls of pressure at the teeth.
PRESWIRL, MOLAR, VISCOSITY, TEMPERATURE, GAMMA = (
    0.98,
    28.96807,
    1.7746561138374613e-05,
    283.15,
    1.0001,
)
HIGH, LOW, TEETH, DIAMETER, CLEARANCE, PITCH, WIDTH = (
    308e3,
    270e3,
    16,
    0.145,
    3e-4,
    3.175e-3,
    1.524e-4,
)
# What its polynomial of the teeth's width gives.
FLOW_COEFFICIENT = 0.6538207763479065


def timed(f, times: int):
    """The first, and the least of the others, s; and what comes out."""
    took = []
    for _ in range(times + 1):
        began = time.perf_counter()
        found = f()
        took.append(time.perf_counter() - began)
    return took[0], min(took[1:]), found


def theirs() -> None:
    import ross
    from ross.seals import labyrinth_seal

    def seal():
        return labyrinth_seal.LabyrinthSeal(
            n=0,
            inlet_pressure=HIGH,
            outlet_pressure=LOW,
            inlet_temperature=TEMPERATURE,
            preswirl=PRESWIRL,
            speed=SPEEDS,
            n_teeth=TEETH,
            shaft_diameter=DIAMETER,
            radial_clearance=CLEARANCE,
            pitch=PITCH,
            tooth_height=PITCH,
            tooth_width=WIDTH,
            seal_type="inter",
            molar_mass=MOLAR,
            reference_temperatures=[TEMPERATURE, 282.60903080958565],
            reference_viscosities=[VISCOSITY, 1.7687886306966975e-05],
            gamma=GAMMA,
        )

    _, pool, _ = timed(seal, 5)
    labyrinth_seal.solve_frequencies = lambda solve, speeds, parallel_threshold: [
        solve(x) for x in speeds
    ]
    _, alone, found = timed(seal, 5)
    rows = [np.ravel(getattr(found, name)).tolist() for name in ("kxx", "kxy", "cxx", "cxy")]
    print(json.dumps([ross.__version__, pool, alone, rows]))


def ours(peer: str | None) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    from machine import header

    import jaxrotor as jr

    print(header())
    seal = jr.elements.LabyrinthSeal(
        diameter=DIAMETER,
        clearance=CLEARANCE,
        pitch=PITCH,
        height=PITCH,
        inlet_pressure=HIGH,
        outlet_pressure=LOW,
        temperature=TEMPERATURE,
        gas_constant=8314 / MOLAR,
        viscosity=VISCOSITY,
        heat_ratio=GAMMA,
        preswirl=PRESWIRL,
        flow_coefficient=FLOW_COEFFICIENT,
        teeth=TEETH,
        on="both",
    )
    first, later, found = timed(lambda: jax.block_until_ready(seal.support(SPEEDS)), 20)
    print("\n| program | first call, s | later, s | ratio |\n|---|---|---|---|")
    print(f"| jaxrotor | {first:.2f} | {later:.4f} | 1 |")
    if peer is None:
        return
    said = subprocess.run([peer, __file__, "--theirs"], capture_output=True, text=True, check=True)
    version, pool, alone, rows = json.loads(said.stdout.splitlines()[-1])
    print(f"| ROSS {version}, its pool of processes | | {pool:.3f} | {pool / later:.0f} |")
    print(f"| ROSS {version}, one process | | {alone:.3f} | {alone / later:.0f} |")
    mine = np.array([t[:, 0, j] for t in (found.stiffness, found.damping) for j in (0, 1)])
    gaps = np.abs(mine / np.array(rows) - 1).max(axis=1)
    print("\nlargest difference of K, k, C, c:", ", ".join(f"{100 * g:.2f} %" for g in gaps))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a Python that has ROSS 3.1")
    parser.add_argument("--theirs", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.theirs:
        sys.exit(theirs())
    ours(given.peer)
