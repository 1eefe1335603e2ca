"""How compiling and running grow with a line: a rotor on a finite-element shaft of more and more stations,
reduced (component mode synthesis) and full, and by ROSS's Newmark method. Each row is a process of its
own without any compiled program kept. Prints a table; nothing is asserted (docs/benchmarks.md has one)."""

import argparse
import json
import resource
import subprocess
import sys
import time

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402

import jaxrotor as jr  # noqa: E402
from jaxrotor.machine.layout import count_of_free  # noqa: E402

RATE = 2000.0  # Hz


def line(stations: int) -> jr.Machine:
    """So many stations in all: bearing, shaft, disc, shaft, driven end."""
    left = (stations - 3) // 2
    right = stations - 3 - left

    def shaft(inner):
        return jr.FiniteElementShaft(
            length=0.3, diameter=0.03, elements=inner + 1, rayleigh=(2.0, 1e-5)
        )

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(left),
            "disc": jr.Rotor(8.0, 0.04, 0.022, unbalance=jr.Unbalance(1e-4)),
            "shaft 2": shaft(right),
            "drive": jr.PrescribedSpin(jr.CosineRamp(speed=200.0, duration=0.5)),
        },
        attachments={
            "bearing": (jr.LinearSupport([1e7, 1e7, 0, 0, 0, 0], [1e3, 1e3, 0, 0, 0, 0]), "left")
        },
    )


def once(stations: int, full: bool) -> dict:
    """Everything of one machine, in a process of its own."""
    found: dict = {"stations": stations}

    def timed(name, f):
        began = time.perf_counter()
        result = jax.block_until_ready(f())
        found[name] = time.perf_counter() - began
        return result

    machine = line(stations)
    if full:
        machine = machine.full()
    else:
        machine = timed("reduce", lambda: machine.reduced(0.5 * RATE))
    plan = timed("plan", lambda: jr.plan(machine, 10.0, RATE))
    found["states"] = 2 * count_of_free(machine)

    def run(seconds):
        return jr.simulate(machine, seconds, RATE, step=plan, progress=False).y

    first = timed("first", lambda: run(10.0)) is not None
    assert first
    timed("ten", lambda: run(10.0))
    found["step"] = found["ten"] / (10.0 * RATE * plan.substeps)

    def peak(mass):
        run = jr.simulate(machine.set({"disc.mass": mass}), 1.0, RATE, step=plan)
        return jnp.max(run["disc"].x)

    slope = jr.jit(jax.grad(peak))
    mass = jnp.asarray(8.0)
    timed("first gradient", lambda: slope(mass))
    timed("gradient", lambda: slope(mass))
    found["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found


def ross_newmark(stations: int) -> dict:
    """ROSS's Newmark at a constant 200 rad/s, 10 s with the steps of the run-up above."""
    import ross

    steel = ross.Material("steel", rho=7850, E=2.1e11, G_s=8.1e10)
    n = stations - 1
    shafts = [
        ross.ShaftElement(0.6 / n, 0, 0.03, material=steel, beta=1e-5, alpha=2.0) for _ in range(n)
    ]
    disc = ross.DiskElement(n // 2, 8.0, 0.022, 0.04)
    bearings = [ross.BearingElement(k, 1e7, 1e3) for k in (0, n)]
    rotor = ross.Rotor(shafts, [disc], bearings)
    t = np.arange(0.0, 10.0, 1.0 / RATE)
    force = np.zeros((t.size, rotor.ndof))
    for c, wave in ((0, np.cos), (1, np.sin)):
        force[:, rotor.number_dof * (n // 2) + c] = 8.0 * 1e-4 * 200.0**2 * wave(200.0 * t)
    began = time.perf_counter()
    rotor.run_time_response(200.0, force, t, method="newmark")
    return {"stations": stations, "ten": time.perf_counter() - began, "states": 2 * rotor.ndof}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stations", type=int, nargs="+", default=[10, 20, 50, 100, 200])
    parser.add_argument("--full", type=int, nargs="*", default=[10, 20, 50])
    parser.add_argument("--ross", type=int, nargs="*", default=[20, 100])
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        kind, stations = given.one[0], int(given.one[1])
        found = ross_newmark(stations) if kind == "ross" else once(stations, kind == "full")
        print(json.dumps(found))
        return
    print(f"JAX {jax.__version__}; 10 s, run up in 0.5 s; {RATE:g} samples a second; seconds")
    columns = (
        ("stations", 1, "d"), ("states", 1, "d"), ("reduce", 1, ".1f"), ("plan", 1, ".1f"),
        ("first", 1, ".1f"), ("ten", 1, ".2f"), ("step", 1e6, ".0f"),
        ("first gradient", 1, ".1f"), ("gradient", 1, ".2f"), ("memory", 1, ".0f"),
    )  # fmt: skip
    print("            " + "".join(f"{name:>16}" for name, _, _ in columns))
    for kind, sizes in (("reduced", given.stations), ("full", given.full), ("ross", given.ross)):
        for stations in sizes:
            command = [sys.executable, __file__, "--one", kind, str(stations)]
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            found = json.loads(out.splitlines()[-1])
            row = (
                f"{found[name] * scale:{form}}" if name in found else ""
                for name, scale, form in columns
            )
            print(f"{kind:12}" + "".join(f"{x:>16}" for x in row), flush=True)


if __name__ == "__main__":
    main()
