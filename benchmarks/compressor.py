"""ROSS's compressor (`ross.compressor_example()`: 56 nodes, 13 seals, tables over speed) run up from rest
through its critical speeds: reduced and with all stations, each in a process of its own; and the reduced one
slowly, beside its own response to unbalance. Prints times and differences; nothing is asserted
(docs/benchmarks.md has a run of it)."""

import argparse
import contextlib
import io
import json
import subprocess
import sys
import time
import warnings

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)
warnings.simplefilter("ignore")

import jaxrotor as jr  # noqa: E402
from jaxrotor.interop import from_ross  # noqa: E402
from jaxrotor.machine.layout import count_of_free  # noqa: E402

TOP, RATE = 900.0, 2000.0  # rad/s, Hz
PLACES = ("node 29", "node 7")


def compressor(seconds: float) -> jr.Machine:
    """Turned by its first node; 3 g·m of unbalance in the middle."""
    with contextlib.redirect_stdout(io.StringIO()):  # of a library that looks for another
        import ross

        rotor = ross.compressor_example()
    drive = {"node 0": {"phi": jr.CosineRamp(speed=TOP, duration=seconds)}}
    return from_ross(rotor, unbalance=[(29, 0.003, 0.0)], prescribed=drive)


def once(kind: str, seconds: float, kept: str) -> dict:
    machine = compressor(seconds)
    began = time.perf_counter()
    machine = machine.full() if kind == "full" else machine.reduced(500.0, speed=TOP)
    found = {"kind": kind, "states": 2 * count_of_free(machine)}
    found["reduce"] = time.perf_counter() - began
    for name in ("first", "again") if kind != "slow" else ("first",):
        began = time.perf_counter()
        run = jr.simulate(machine, seconds, RATE, tolerance=1e-4, progress=False)
        jax.block_until_ready(run.y)
        found[name] = time.perf_counter() - began
    found["error told"] = float(run.info.error)
    paths = {place: np.stack([run[place].x, run[place].y]) for place in PLACES}
    if kind == "slow":
        speed = np.asarray(run["node 0"].speed)
        # beyond the first of the run, every so many samples
        some = np.arange(speed.size // 20, speed.size - 1, speed.size // 300)
        steady = jr.unbalance_response(
            machine, [f"{p}.{c}" for p in PLACES for c in "xy"], speed[some]
        )
        angle = np.asarray(run["node 0"].phi)[some]
        whirl = np.real(np.asarray(steady.values) * np.exp(1j * angle)[:, None]).T
        for i, place in enumerate(PLACES):
            off = np.abs(paths[place][:, some] - whirl[2 * i : 2 * i + 2]).max()
            found[f"{place} off steady"] = float(off / np.abs(whirl[2 * i : 2 * i + 2]).max())
        return found
    if kind == "full":
        np.savez(kept, **paths)
    elif kept:
        theirs = np.load(kept)
        for place, path in paths.items():
            off = np.abs(path - theirs[place]).max()
            found[f"{place} off full"] = float(off / np.abs(theirs[place]).max())
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--slowly", type=float, default=40.0)
    parser.add_argument("--kinds", nargs="+", default=["full", "reduced", "slow"])
    parser.add_argument("--kept", default="", help="the full one's paths, .npz")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        seconds = given.slowly if given.one == "slow" else given.seconds
        print(json.dumps(once(given.one, seconds, given.kept)))
        return
    for kind in given.kinds:
        command = [sys.executable, __file__, "--one", kind, "--kept", given.kept]
        command += ["--seconds", str(given.seconds), "--slowly", str(given.slowly)]
        out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found = json.loads(next(x for x in out.splitlines() if x.startswith("{")))
        print(", ".join(f"{k} {v:.4g}" if k != "kind" else v for k, v in found.items()), flush=True)


if __name__ == "__main__":
    main()
