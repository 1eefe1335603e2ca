"""Static and dynamic characteristic of an elastic coupling, from two runs on a bench.

The bench of configs/coupling_bench.toml turns a motor and a brake with the coupling between them. In
one run the motor's torque comes on at once, in the other the brake bites while the line turns. From the
speeds of both sides and the torque between them five parameters are found: a progressive spring, its
damper, and a branch that relaxes; all of them 50 % wrong at first. The figure shows what that means:
torque over twist, and dynamic stiffness and loss angle over frequency, with what the data leave open.

    python experiments/identify_coupling.py [--out results/identify_coupling]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np
from synthetic import (
    BENCH,
    BENCH_NOISE,
    COUPLING,
    COUPLING_RUNS,
    HERE,
    LOAD_STEP,
    channels,
    compared,
    coupling_bench,
    coupling_runs,
)

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.identification import channel_fits, profile_curves
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

TWIST = np.linspace(0.0, np.radians(6.0), 61)  # rad
FREQUENCY = np.linspace(0.1, 60.0, 200)  # Hz


def unknowns() -> list[jr.Unknown]:
    # the cubic term may be of either sign
    return [
        jr.Unknown(path) if path.endswith("[1]") else jr.Unknown(path, positive=True)
        for path in COUPLING
    ]


def trials(records) -> list[jr.MeasuredRun]:
    return [
        jr.MeasuredRun(
            record, initial="undeformed", step=COUPLING_RUNS["step"], conditions=conditions
        )
        for record, conditions in zip(records, ({}, LOAD_STEP))
    ]


def identified(sensed, records) -> jr.identification.Identification:
    wrong = coupling_bench({path: 1.5 * value for path, value in COUPLING.items()})
    # what is slow first: there no cycle is skipped
    return jr.identify(
        wrong,
        unknowns(),
        sensed,
        trials(records),
        stages=(jr.identification.Frequencies(0.0, 12.0), jr.identification.Time()),
    )


def static(p):
    """Torque (N·m) over `TWIST`."""
    k1, k3, *_ = p
    return k1 * TWIST + k3 * TWIST**3


def dynamic(p):
    """Complex stiffness (N·m/rad) of small vibrations over `FREQUENCY`: spring and damper, and in series the
    branch's."""
    k1, _, c, k, d = p
    s = 2j * np.pi * FREQUENCY
    return k1 + c * s + k * d * s / (k + d * s)


def band(curve, p, covariance):
    """A curve and its standard deviation, to first order."""
    slopes = np.asarray(jax.jacfwd(curve)(p))
    return np.asarray(curve(p)), np.sqrt(np.einsum("ki,ij,kj->k", slopes, covariance, slopes))


def characteristics(found: jr.identification.Identification):
    p = jnp.array([found.values[path] for path in COUPLING])
    std = np.array([found.std[path] for path in COUPLING])
    covariance = found.correlation * np.outer(std, std)
    truth, wrong = (factor * jnp.array(list(COUPLING.values())) for factor in (1.0, 1.5))
    fig, axes = figure(1, 3, (14.0, 4.2))
    curves = (
        (static, np.degrees(TWIST), "twist, deg", "torque, N*m"),
        (lambda p: jnp.abs(dynamic(p)), FREQUENCY, "frequency, Hz", "dynamic stiffness, N*m/rad"),
        (lambda p: jnp.degrees(jnp.angle(dynamic(p))), FREQUENCY, "frequency, Hz", "loss angle, deg"),
    )  # fmt: skip
    for ax, (curve, x, across, up) in zip(axes[0], curves):
        ax.plot(x, curve(wrong), ":", color=GREY, label="start")
        ax.plot(x, curve(truth), color="black", linewidth=2.5, label="truth")
        middle, std = band(curve, p, covariance)
        low, high = middle - 1.96 * std, middle + 1.96 * std
        ax.fill_between(x, low, high, color=COLOURS[1], alpha=0.4, linewidth=0, label="95 %")
        ax.plot(x, middle, "--", color=COLOURS[1], label="identified")
        label(ax, across, up)
    legend(axes[0, 0])
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/identify_coupling"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    files = ("coupling_start.toml", "coupling_load_step.toml")
    records = [jr.read_record(HERE / "data" / file) for file in files]
    found = identified(channels(BENCH, BENCH_NOISE), records)
    print("from the records:")
    print(found)
    print(compared(found, COUPLING, noisy=True))
    found.save(out / "identification.json")
    pictures = {
        "characteristics": characteristics(found),
        "fit": channel_fits(found),
        "profile": profile_curves(found, jr.identification.likelihood_profiles(found)),
    }
    for name, picture in pictures.items():
        save_figure(picture, out / f"{name}.png")
    clean = identified(*coupling_runs(0.0, 0))
    print("without noise:")
    print(compared(clean, COUPLING, noisy=False))
    print("iterations:", {name: len(costs) for name, costs in clean.histories.items()})
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {out}/")


if __name__ == "__main__":
    main()
