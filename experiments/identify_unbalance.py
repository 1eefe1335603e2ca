"""Six unbalance parameters of the two-rotor machine, from one run-up.

The machine of Matyja & Łazarz (2014) runs up to 1000 rad/s. Recorded are the accelerations of its two
bearing housings, across and upwards, and a tachometer at the second rotor, each with noise. Looked for are
static and dynamic unbalance of the main rotor and the static unbalance of the second one, each 50 % wrong at
first and its angle by 143 degrees: four starts are searched in one batch, by order first, then over time.
Then the run is identified again without noise, to see what the method itself can do.

    python experiments/identify_unbalance.py [--out results/identify_unbalance] [--noise 0.05] [--seed 1]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np

import jaxrotor as jr
from jaxrotor.files import written_whole
from jaxrotor.plot import channel_fits, correlations, costs

STUDY = Path(__file__).parent.parent / "configs" / "two_rotor_startup.toml"
END, RATE = 2.5, 2000.0  # s, Hz
TRUTH = {
    "main.unbalance.eccentricity": 5e-4,
    "main.unbalance.angle": 0.6,
    "main.unbalance.inclination": np.deg2rad(1.0),
    "main.unbalance.inclination_angle": -1.1,
    "second.unbalance.eccentricity": 1e-5,
    "second.unbalance.angle": 2.2,
}
# rms of what each sensor sees, for noise of so much of it
SENSORS = {
    "left across": (jr.Accelerometer("left", (1, 0, 0)), 1.0),
    "left up": (jr.Accelerometer("left", (0, 1, 0)), 1.0),
    "right across": (jr.Accelerometer("right", (1, 0, 0)), 1.0),
    "right up": (jr.Accelerometer("right", (0, 1, 0)), 1.0),
    "tacho": (jr.Tachometer("second"), 1.0),
}


def build(values=TRUTH) -> jr.Machine:
    return jr.load(STUDY).machine.set(values)


def recorded(noise: float, seed: int, machine=None):
    """Channels with noise of so much of the root mean square of what each sees (the tachometer: of the change
    of its speed about the ramp), and the record."""
    machine = build() if machine is None else machine
    run = jr.simulate(machine, END + 2 / RATE, RATE)
    t = np.arange(int(END * RATE) + 1) / RATE
    keys = jax.random.split(jax.random.key(seed), len(SENSORS))
    channels, series = {}, {}
    for key, (name, (sensor, _)) in zip(keys, SENSORS.items()):
        clean = np.asarray(jr.Channel(sensor).measure(run, t))
        swing = clean - np.asarray(run["end"].speed)[: t.size] if name == "tacho" else clean
        std = noise * np.sqrt(np.mean(swing**2))
        channels[name] = jr.Channel(sensor, noise=jr.Noise(std) if noise else None)
        values = channels[name].recorded(run, key, t)
        series[name] = jr.Series(t, values, sensor.unit)
    return channels, jr.Record(series, "run-up")


def unknowns() -> list[jr.Unknown]:
    return [
        jr.Unknown(path, circular=True) if "angle" in path else jr.Unknown(path, positive=True)
        for path in TRUTH
    ]


def start() -> tuple[jr.Machine, list[dict]]:
    """Everything 50 % wrong, angles 2.5 rad; and three more starts with other angles."""
    wrong = {p: v - 2.5 if "angle" in p else 1.5 * v for p, v in TRUTH.items()}
    turned = []
    for a, b in ((np.pi, 0.0), (0.0, np.pi), (np.pi, np.pi)):
        turned.append(
            {
                "main.unbalance.angle": wrong["main.unbalance.angle"] + a,
                "main.unbalance.inclination_angle": wrong["main.unbalance.inclination_angle"] + b,
                "second.unbalance.angle": wrong["second.unbalance.angle"] + a,
            }
        )
    return build(wrong), turned


def identified(noise: float, seed: int) -> jr.Identification:
    channels, record = recorded(noise, seed)
    machine, starts = start()
    return jr.identify(
        machine,
        unknowns(),
        channels,
        record,
        stages=(jr.Orders(), jr.Time()),
        starts=starts,
        shaft="main",
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/identify_unbalance"))
    parser.add_argument("--noise", type=float, default=0.05, help="of what each sensor sees")
    parser.add_argument("--seed", type=int, default=1, help="of the noise")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    found = identified(given.noise, given.seed)
    print(f"with {100 * given.noise:g} % noise (seed {given.seed}):")
    print(found)
    for path, value in TRUTH.items():
        off = (found.values[path] - value) / found.std[path]
        print(f"  {path}: truth {value:.6g}, {off:+.2f} standard deviations off")
    found.save(given.out / "identification.json")
    for name, draw in (("fit", channel_fits), ("correlation", correlations), ("cost", costs)):
        with written_whole(given.out / f"{name}.png") as part:
            draw(found).savefig(part, dpi=150, format="png", bbox_inches="tight")
    clean = identified(0.0, 0)
    print("without noise:")
    for path, value in TRUTH.items():
        away = clean.values[path] - value
        size = f"{abs(away):.1e} rad" if "angle" in path else f"{abs(away / value):.1e} of it"
        print(f"  {path}: {size} off")
    print(f"iterations: {[len(h) for h in clean.histories]}")
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {given.out}")


if __name__ == "__main__":
    main()
