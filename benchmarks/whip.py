"""A rotor of forty stations on two plain journal bearings, run up into whip by the stiff solver: with a shaft
without mass, reduced (component mode synthesis) and with all stations. Prints onset, whirl and times, each
machine in a process of its own; nothing is asserted (docs/benchmarks.md has a run of it)."""

import argparse
import json
import subprocess
import sys
import time

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import jaxrotor as jr  # noqa: E402
from jaxrotor.machine.layout import count_of_free  # noqa: E402

RATE, SECONDS, FIRST, LAST = 4000.0, 2.0, 150.0, 1070.0
# The whirl at half the speed shows from this part of the clearance on.
SHOWN = 0.2
CLEARANCE = 0.15e-3


def machine(kind: str) -> jr.Machine:
    """configs/oil_film_rotor.toml, with mass in its shafts but for the kind "rods"."""

    def shaft():
        given = dict(length=0.25, diameter=0.022, rayleigh=(0.0, 2e-5))
        return jr.Shaft(**given) if kind == "rods" else jr.FiniteElementShaft(elements=19, **given)

    film = jr.JournalBearing(0.03, 0.012, CLEARANCE, 0.04)
    end = dict(mass=0.4, polar_inertia=5e-5, transverse_inertia=1e-4)
    found = jr.Machine.in_line(
        {
            "drive": jr.PrescribedSpin(jr.LinearRamp(start=FIRST, speed=LAST, duration=SECONDS)),
            "quill": jr.Coupling([0, 0, 0, 0, 0, 1e4], [0, 0, 0, 0, 0, 1]),
            "left": jr.Rotor(**end),
            "shaft 1": shaft(),
            "disc": jr.Rotor(4.0, 0.012, 0.007, unbalance=jr.Unbalance(20e-6)),
            "shaft 2": shaft(),
            "right": jr.Rotor(**end),
        },
        attachments={"left film": (film, "left"), "right film": (film, "right")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"left": ["z"]},
    )
    return found.reduced(1000.0, speed=LAST) if kind == "reduced" else found.full()


def once(kind: str, seconds: float) -> dict:
    made = machine(kind)
    simulation = jr.Simulation(seconds, RATE, initial="running")
    times = []
    for _ in range(2):
        began = time.perf_counter()
        run = jr.simulate(made, simulation, progress=False)
        jax.block_until_ready(run.y)
        times.append(time.perf_counter() - began)
    x, y = (np.asarray(getattr(run["left"], c)) for c in "xy")
    disc = np.hypot(np.asarray(run["disc"].x), np.asarray(run["disc"].y))
    speed = np.asarray(run["drive"].speed)
    # what is slower than three quarters of a turn, over a tenth of a second
    count = int(0.1 * RATE)
    size, which = [], []
    for first in range(0, x.size - count, count // 4):
        z = (x + 1j * y)[first : first + count]
        spectrum = np.abs(np.fft.fft((z - z.mean()) * np.hanning(count), 16 * count)) / count * 2
        w = 2 * np.pi * np.fft.fftfreq(16 * count, 1 / RATE)
        slow = (w > 0.3 * speed[first]) & (w < 0.75 * speed[first])
        size.append(spectrum[slow].max())
        which.append(w[slow][spectrum[slow].argmax()])
    shows = np.argmax(np.array(size) > SHOWN * CLEARANCE) * (count // 4) + count // 2
    return {
        "kind": kind,
        "states": 2 * count_of_free(made),
        "first": times[0],
        "again": times[1],
        "steps": int(run.info.steps),
        "onset": float(speed[shows]),
        "whirl": float(which[-1] / speed[-1]),
        "orbit": float(np.hypot(x, y)[-count:].max() / CLEARANCE),
        "disc": float(disc[-count:].max()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--kinds", nargs="+", default=["rods", "reduced", "full"])
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(once(given.one, given.seconds)))
        return
    print(
        "whip shows at, rad/s; whirl / speed and orbit / clearance at the end; disc in m; times in s"
    )
    columns = ("states", "first", "again", "steps", "onset", "whirl", "orbit", "disc")
    print(f"{'':8}" + "".join(f"{name:>12}" for name in columns))
    for kind in given.kinds:
        command = [sys.executable, __file__, "--one", kind, "--seconds", str(given.seconds)]
        out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found = json.loads(out.splitlines()[-1])
        print(f"{kind:8}" + "".join(f"{found[name]:12.6g}" for name in columns), flush=True)


if __name__ == "__main__":
    main()
