"""Which balancing grade keeps 95 % of the passages under a limit? 2,000 two-rotor machines.

The machine of Matyja & Łazarz (2014) is run up through its critical speed. Its rotors are balanced to a grade
G of ISO 21940-11 at 1000 rad/s: within the permissible eccentricity G/1000 their unbalance is random, in
size and angle. Bearing stiffness and damping scatter by 20 and 30 %, the shafts' damping by 30 %. For each
of four grades 500 machines: how many keep the overhung rotor within the limit, and which grade would do for
95 %?

    python experiments/tolerance_study.py [--out DIR] [--machines 500] [--limit 0.15] [--store]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
import scipy.stats as st
from active_torsional_damper import line

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

GRADES = (2.5, 6.3, 16.0, 40.0)  # mm/s
SPEED = 1000.0  # rad/s
T_END, RATE = 2.6, 1000.0
EDGES = np.linspace(50.0, SPEED, 39)
OUTPUTS = {
    "deflection": jr.objectives.PeakValue(jr.sensors.Radial("second")),
    "bearing force": jr.objectives.PeakValue(jr.sensors.BearingForce("left")),
    "over speed": jr.sweeps.OverSpeed(jr.sensors.Radial("second"), "end", EDGES),
}


def machine() -> jr.Machine:
    return line(0.002, jr.PrescribedSpin(jr.CosineRamp(SPEED, 2.5)), {}, twist="paper")


def cases(count: int, seed: int = 0) -> jr.Cases:
    """All grades in one table, the same draws for each: what differs is the grade alone."""
    share, turn = st.uniform(0, 1), st.uniform(-np.pi, 2 * np.pi)
    drawn = jr.Cases.sampled(
        {
            "main.unbalance.eccentricity": share,
            "main.unbalance.angle": turn,
            "second.unbalance.eccentricity": share,
            "second.unbalance.angle": turn,
            "left.stiffness": st.uniform(0.8e6, 0.4e6),
            "right.stiffness": st.uniform(0.8e6, 0.4e6),
            "left.damping": st.uniform(140.0, 120.0),
            "right.damping": st.uniform(140.0, 120.0),
            "shaft 1.rayleigh[1]": st.uniform(0.0014, 0.0012),
        },
        count,
        seed=seed,
    ).tied({f"shaft {k}.rayleigh[1]": "shaft 1.rayleigh[1]" for k in (2, 3, 4)})
    rows = {path: np.tile(x, len(GRADES)) for path, x in drawn.values.items()}
    for rotor in ("main", "second"):
        # evenly over the disc of permissible eccentricity, mm/s over rad/s is mm
        radius = np.sqrt(drawn.values[f"{rotor}.unbalance.eccentricity"])
        rows[f"{rotor}.unbalance.eccentricity"] = np.concatenate(
            [g / SPEED * 1e-3 * radius for g in GRADES]
        )
    return jr.Cases(rows, f"{drawn.how}, for the grades G {', '.join(map(str, GRADES))}")


def swept(count: int, seed: int = 0, **more):
    start = machine().set({"main.unbalance.inclination": 0.0})
    return jr.sweep(start, cases(count, seed), OUTPUTS, t_end=T_END, sample_rate=RATE, **more)


def shares(values: np.ndarray, limit: float):
    """Share of each grade's machines within the limit, with its 95 % interval (Wilson)."""
    found = []
    for own in np.split(values, len(GRADES)):
        inside = int(np.sum(own <= limit))
        low, high = st.binomtest(inside, own.size).proportion_ci(method="wilson")
        found.append((inside / own.size, low, high))
    return np.array(found)


def grade_for(values: np.ndarray, limit: float, share: float = 0.95) -> float:
    """The grade whose percentile meets the limit, mm/s: between two grades percentiles grow like a power of
    the grade. NaN beyond them."""
    reached = [np.quantile(own, share) for own in np.split(values, len(GRADES))]
    if not reached[0] <= limit <= reached[-1]:
        return float("nan")
    return float(np.exp(np.interp(np.log(limit), np.log(reached), np.log(GRADES))))


def draw(found, limit: float):
    fig, axes = figure(1, 2, (13.0, 4.8))
    bands, share = axes[0]
    speed = found["over speed_speed"].values
    rows = 1e3 * found["over speed"].values
    for own, grade, colour in zip(np.split(rows, len(GRADES)), GRADES, COLOURS):
        middle, high = np.nanpercentile(own, [50, 95], axis=0)
        bands.plot(speed, high, color=colour, label=f"G {grade:g}")
        bands.plot(speed, middle, color=colour, lw=1, ls=":")
    bands.axhline(1e3 * limit, color="black", linestyle="--", label="limit")
    bands.set_ylim(bottom=0)
    label(bands, "speed, rad/s", "deflection of second, mm", "95th percentile (median dotted)")
    legend(bands)
    values = found["deflection"].values
    got = 100 * shares(values, limit)
    errors = np.abs(got[:, 1:] - got[:, :1]).T
    share.errorbar(GRADES, got[:, 0], errors, fmt="o-", color=COLOURS[0], capsize=4)
    share.axhline(95, color="black", linestyle="--")
    share.set_xscale("log")
    share.set_xticks(GRADES, [f"{g:g}" for g in GRADES])
    share.minorticks_off()
    label(share, "balancing grade G, mm/s", "machines within the limit, %", "95 % dashed")
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/tolerance_study"))
    parser.add_argument("--machines", type=int, default=500, help="of each grade (default: 500)")
    parser.add_argument("--limit", type=float, default=0.15, help="deflection, mm (default: 0.15)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--store", action="store_true", help="keep a Zarr store that can be resumed"
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    more = dict(store=given.out / "sweep.zarr") if given.store else {}
    found = swept(given.machines, given.seed, **more)
    values, limit = found["deflection"].values, 1e-3 * given.limit
    failed = int(np.sum(found["failure"].values != ""))
    print(f"{values.size} machines, {found.attrs['seconds']:.0f} s; failed: {failed}")
    print(
        "grade    median      95th percentile   within the limit (95 % interval)   left bearing, 95 %"
    )
    forces = np.split(found["bearing force"].values, len(GRADES))
    for grade, own, force, (share, low, high) in zip(
        GRADES, np.split(values, len(GRADES)), forces, shares(values, limit)
    ):
        print(
            f"G {grade:<5g}  {1e3 * np.median(own):.4f} mm   {1e3 * np.quantile(own, 0.95):.4f} mm         "
            f"{100 * share:5.1f} % ({100 * low:.1f} to {100 * high:.1f} %)            "
            f"{np.quantile(force, 0.95):.0f} N"
        )
    print(f"95 % stay within {given.limit:g} mm up to G {grade_for(values, limit):.3g} mm/s")
    save_figure(draw(found, limit), given.out / "tolerance.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figure in {given.out}/")


if __name__ == "__main__":
    main()
