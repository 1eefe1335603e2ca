"""Six unbalance parameters of the two-rotor machine, from one run-up.

The machine of Matyja & Łazarz (2014) runs up to 1000 rad/s in 2.5 s. Recorded are the accelerations of
its two bearing housings, across and upwards, and a tachometer at the second rotor (experiments/data).
Looked for are static and dynamic unbalance of the main rotor and the static one of the second, each 50
% wrong at first and its angle by 180 degrees: four starts are searched in one batch, by order first,
then over time. Then the same without noise, to see what the method itself can do.

    python experiments/identify_unbalance.py [--out results/identify_unbalance]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from synthetic import HERE, HOUSINGS, RUN_UP, UNBALANCE, channels, compared, run_up, two_rotors

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.identification import channel_fits, correlations, costs, profile_curves


def unknowns() -> list[jr.Unknown]:
    return [
        jr.Unknown(path, circular=True) if "angle" in path else jr.Unknown(path, positive=True)
        for path in UNBALANCE
    ]


def wrong() -> tuple[jr.Machine, list[dict[str, float]]]:
    """Everything 50 % wrong, angles by 180 degrees; and three more starts with other angles."""
    start = {p: v + np.pi if "angle" in p else 1.5 * v for p, v in UNBALANCE.items()}
    angles = [p for p in UNBALANCE if "angle" in p]
    turned = [(0.5, 0.5, 0.5), (1.0, 0.0, 1.0), (1.5, 1.5, 1.5)]  # half turns further
    starts = [{p: start[p] + np.pi * a for p, a in zip(angles, turn)} for turn in turned]
    return two_rotors(start), starts


def identified(sensed, record, **options) -> jr.identification.Identification:
    machine, starts = wrong()
    return jr.identify(
        machine,
        unknowns(),
        sensed,
        jr.MeasuredRun(record, step=RUN_UP["step"]),
        stages=(jr.identification.Orders(), jr.identification.Time()),
        starts=starts,
        shaft="main",
        **options,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/identify_unbalance"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    record = jr.read_record(HERE / "data" / "two_rotor_run_up.toml")
    found = identified(channels(HOUSINGS), record)
    print("from the record, its noise unknown:")
    print(found)
    print(compared(found, UNBALANCE, noisy=True))
    found.save(out / "identification.json")
    pictures = {
        "fit": channel_fits(found),
        "correlation": correlations(found),
        "cost": costs(found),
        "profile": profile_curves(found, jr.identification.likelihood_profiles(found)),
    }
    for name, picture in pictures.items():
        save_figure(picture, out / f"{name}.png")
    print("correction in two planes of the main rotor, g*mm and degrees:")
    correction = jr.identification.correction(found, "main", (-0.05, 0.05))
    for z, one, std in zip((-50, 50), correction.unbalance, correction.std):
        print(
            f"  z = {z:+d} mm: {1e6 * abs(one):.0f} at {np.degrees(np.angle(one)):.2f}, standard deviation "
            f"{1e6 * abs(std):.1f}"
        )
    clean = identified(*run_up(0.0, 0))
    print("without noise:")
    print(compared(clean, UNBALANCE, noisy=False))
    print("iterations:", {name: len(costs) for name, costs in clean.histories.items()})
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {out}/")


if __name__ == "__main__":
    main()
