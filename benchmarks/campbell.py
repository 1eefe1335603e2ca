"""A Campbell diagram of 100 speeds of a rotor of 50 elements, beside ROSS's. Prints a table; nothing is
asserted (docs/benchmarks.md has a run of it)."""

import argparse
import time
import warnings

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

from machine import header  # noqa: E402

import jaxrotor as jr  # noqa: E402
from jaxrotor.interop.ross import from_ross

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import ross


def rotor(elements: int):
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    shafts = [ross.ShaftElement(1.5 / elements, 0, 0.05, material=steel) for _ in range(elements)]
    disks = [
        ross.DiskElement.from_geometry(k * elements // 3, steel, 0.07, 0.05, d)
        for k, d in ((1, 0.28), (2, 0.35))
    ]
    bearings = [ross.BearingElement(n, 1e6, 100.0, kyy=0.8e6) for n in (0, elements)]
    return ross.Rotor(shafts, disks, bearings)


def timed(f):
    began = time.perf_counter()
    found = f()
    return time.perf_counter() - began, found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--elements", type=int, default=50)
    parser.add_argument("--speeds", type=int, default=100)
    given = parser.parse_args()
    print(header("ross-rotordynamics"))
    speeds = np.linspace(1.0, 500.0, given.speeds)
    theirs = rotor(given.elements)
    machine = from_ross(theirs)
    compile_s, _ = timed(lambda: jr.linearize(machine, 1.0, at="undeformed").A.block_until_ready())
    runs = []
    for _ in range(2):  # in turn, so that both see the same machine
        mine_s, mine = timed(lambda: jr.campbell(machine, speeds, 12, at="undeformed"))
        fresh = rotor(given.elements)  # a rotor of ROSS remembers the modes it was asked for
        ross_s, other = timed(lambda: fresh.run_campbell(speeds, frequencies=12))  # noqa: B023
        runs.append((mine_s, ross_s))
    mine_s, ross_s = np.min(runs, axis=0)
    found, expected = np.sort(mine.frequencies, axis=1), np.sort(other.wd, axis=1)
    gap = np.abs(found[:, :6] / expected[:, :6] - 1).max()
    print(f"\n{given.elements} elements, {given.speeds} speeds, 12 modes")
    print("| program | compile, s | run, s | ratio |\n|---|---|---|---|")
    print(f"| jaxrotor | {compile_s:.1f} | {mine_s:.2f} | 1 |")
    print(f"| ROSS | - | {ross_s:.2f} | {ross_s / mine_s:.2f} |")
    print(f"the six lowest frequencies agree to {gap:.1e}")


if __name__ == "__main__":
    main()
