"""A measured rig: unknown unbalances from the vectors of four probes.

A Bently Nevada RK-4 with two discs ran at 1005 and 1206 rpm under 27 known unbalances, and under ten that
were kept from the analyst (of five the truth is still withheld). Influence coefficients are taken from the
known ones, all together: what drifts between runs moves all probes alike, and counts together; what the runs
of one day share, for the baseline has moved since, is a random vector of that day; vectors that stand out are
left out and named. Then each blind run is asked for its two unbalances, with intervals.
Source of the measurements: M. Nouioua, rk4-rotor-unbalance-estimation (MIT; experiments/data/rk4_rig).

    python experiments/rk4_rig.py [--out results/rk4_rig]
"""

import argparse
import csv
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.identification import FoundUnbalance, Influence, influence
from jaxrotor.plot.style import COLOURS, GREY, figure, label

DATA = Path(__file__).parent / "data" / "rk4_rig"
PROBES = ("plane1_x", "plane1_y", "plane2_x", "plane2_y")
SPEEDS = ("N1", "N2")
MEASUREMENTS = tuple(f"{probe} at {speed}" for speed in SPEEDS for probe in PROBES)
MIL = 25.4  # um
# Days as the source tells them. The baseline is of none of these. Of the blind runs it says nothing; what no
# unbalance explains in their vectors is no more than drift, so no day of their own is put in.
EARLIER, LATER = ("A007", "A008", "A015"), ("A027", "B007", "B031")
# An angle counts for the mean error where there is this much, g mm.
LARGE = 24.0


class Condition(NamedTuple):
    """`unbalance`: (2,) complex, g mm, of discs 1 and 2; NaN where it is withheld. `vectors`: (8,) complex,
    um, 0-peak and lag, less the baseline; NaN where not measured."""

    block: str
    unbalance: np.ndarray
    vectors: np.ndarray


def conditions() -> dict[str, Condition]:
    """By name, as measured; the baseline's own record is left out."""
    found: dict[str, Condition] = {}
    with (DATA / "conditions.csv").open() as file:
        for row in csv.DictReader(file):
            if row["block"] == "baseline":
                continue

            def number(key, row=row):
                return complex(float(row[f"{key}_re"]), float(row[f"{key}_im"]))

            one = found.setdefault(
                row["condition_id"],
                Condition(
                    row["block"], np.array([number("u1"), number("u2")]), np.full(8, np.nan + 0j)
                ),
            )
            first = len(PROBES) * SPEEDS.index(row["speed_id"])
            one.vectors[first : first + 4] = [MIL * number(f"{probe}_resp") for probe in PROBES]
    return found


def day(name: str) -> str | None:
    """When it was measured, as far as that is known."""
    if name.startswith("BLND"):
        return None
    return "four hours before" if name in EARLIER else "26 July" if name in LATER else "main"


def told(known: dict[str, Condition], left_out: str | None = None) -> tuple[list[str], Influence]:
    """Names of the runs that were learnt from, and what they told."""
    names = [name for name in known if name != left_out]
    return names, influence(
        [known[name].unbalance for name in names],
        [known[name].vectors for name in names],
        days=[day(name) for name in names],
    )


def misfit(found: Influence, runs: list[Condition]) -> dict[str, float]:
    """What is left of the vectors once what was added is taken off, as part of their size, by speed."""
    left = np.array([one.vectors - found.predicted(one.unbalance)[0] for one in runs])
    seen = np.array([one.vectors for one in runs])
    parts = {speed: slice(4 * k, 4 * k + 4) for k, speed in enumerate(SPEEDS)}
    length = lambda x: np.sqrt(np.nansum(np.abs(x) ** 2))  # noqa: E731
    return {speed: float(length(left[:, s]) / length(seen[:, s])) for speed, s in parts.items()}


def errors(found: list[FoundUnbalance], truth: list[np.ndarray]) -> tuple[float, float, float]:
    """Mean error of size (g mm), of angle (degrees, where there is enough), and the part that was covered."""
    u, v = np.array([one.unbalance for one in found]), np.array(truth)
    large = np.abs(v) >= LARGE
    turned = np.abs(np.angle(u[large] / v[large], deg=True))
    covered = np.array([one.covers(v) for one, v in zip(found, truth)])
    return float(np.abs(np.abs(u) - np.abs(v)).mean()), float(turned.mean()), float(covered.mean())


def row_of(name: str, one: FoundUnbalance) -> list[str]:
    size, angle = one.intervals()
    return [
        name,
        *(
            text
            for u, s, a in zip(one.unbalance, size, np.degrees(angle))
            for text in (f"{abs(u):.1f}", f"{s:.1f}", f"{np.angle(u, deg=True):.1f}", f"{a:.1f}")
        ),
        f"{one.chance:.3f}",
    ]


HEADS = (
    "condition",
    *(f"{what} {k}" for k in (1, 2) for what in ("u", "u 95 %", "angle", "angle 95 %")),
)


def drawn(found: dict[str, FoundUnbalance], truth: dict[str, np.ndarray]) -> np.ndarray:
    """Both planes: where each unbalance is thought to lie, with its disc of 95 %, and where it was."""
    _, axes = figure(1, 2, (12.0, 6.2))
    for k, panel in enumerate(axes[0]):
        for j, (name, one) in enumerate(found.items()):
            u, v, colour = one.unbalance[k], truth[name][k], COLOURS[j % len(COLOURS)]
            place, line = (u.real, u.imag), "-" if j < len(COLOURS) else "--"
            panel.add_patch(plt.Circle(place, one.disc()[k], fill=False, color=colour, ls=line))
            panel.plot(
                *place, ".", color=colour, label=f"{name}{'' if np.isfinite(v) else ' (withheld)'}"
            )
            if np.isfinite(v):
                panel.plot([u.real, v.real], [u.imag, v.imag], color=colour, linewidth=0.8)
                panel.plot(v.real, v.imag, "x", color="black", markersize=7)
        for size in (20, 40, 60):
            panel.add_patch(plt.Circle((0, 0), size, fill=False, color=GREY, linewidth=0.5))
        panel.set_aspect("equal")
        panel.set_xlim(-72, 72)
        panel.set_ylim(-72, 72)
        label(
            panel,
            "m r cos(angle), g mm",
            "m r sin(angle), g mm",
            f"disc {k + 1}: estimates with their discs of 95 %; crosses: what was there",
        )
    axes[0, 1].legend(frameon=False, fontsize=8, loc="lower right")
    return axes


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/rk4_rig"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    every = conditions()
    known = {name: one for name, one in every.items() if one.block != "blind"}
    blind = {name: one for name, one in every.items() if one.block == "blind"}
    names, found = told(known)
    print(
        f"influence coefficients from {len(known)} runs; tail of what drifts: t with {found.tail:g}"
    )
    for k in found.doubted:
        print(f"  {names[k]} stands out with most of its vectors: is it labelled rightly?")
    for k, row in enumerate(found.left_out):
        if row.any() and k not in found.doubted:
            print(f"  {names[k]}: left out {', '.join(np.array(MEASUREMENTS)[row])}")
    checked = [one for one in blind.values() if np.isfinite(one.unbalance).all()]
    trusted = [known[name] for k, name in enumerate(names) if k not in found.doubted]
    for words, runs in (
        ("all known runs", [*known.values()]),
        ("those that are labelled rightly", trusted),
        ("blind runs", checked),
    ):
        told_of = ", ".join(f"{s} {100 * x:.1f} %" for s, x in misfit(found, runs).items())
        print(f"responses of {words} are missed by {told_of}")
    for label_, vector in found.days.items():
        print(
            f"day '{label_}': {np.sqrt(np.mean(np.abs(vector) ** 2)):.2f} um rms beside the baseline"
        )
    guesses = {
        name: found.unbalance(one.vectors, unit="g*mm", day=day(name))
        for name, one in blind.items()
    }
    size, angle, covered = errors(
        [guesses[name] for name, one in blind.items() if np.isfinite(one.unbalance).all()],
        [one.unbalance for one in checked],
    )
    print(
        f"{len(checked)} blind runs: {size:.2f} g mm, {angle:.1f} degrees, {100 * covered:.0f} % covered"
    )
    sound = [name for k, name in enumerate(names) if k not in found.doubted]
    apart = [told(known, name)[1].unbalance(known[name].vectors, day=day(name)) for name in sound]
    size, angle, covered = errors(apart, [known[name].unbalance for name in sound])
    print(
        f"each of {len(sound)} known runs left out: {size:.2f} g mm, {angle:.1f} degrees, ", end=""
    )
    print(f"{100 * covered:.0f} % covered")
    rows = [row_of(name, one) for name, one in guesses.items()]
    with (out / "blind.csv").open("w", newline="") as file:
        csv.writer(file).writerows([(*HEADS, "chance"), *rows])
    print("\n".join("  ".join(x.rjust(10) for x in row) for row in [(*HEADS, "chance"), *rows]))
    save_figure(drawn(guesses, {n: one.unbalance for n, one in blind.items()}), out / "blind.png")
    print(f"figures and table in {out}/ (jaxrotor {jr.__version__})")


if __name__ == "__main__":
    main()
