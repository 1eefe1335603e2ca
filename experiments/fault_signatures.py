"""What faults look like: the signatures that a diagnostician knows, each from a small machine.

rub            a disc that touches its stator: harmonics and backward components in the full spectrum
outer race     a pit in a ball bearing: the ball-pass frequency and its multiples in the envelope's
spectrum inner race     the same in the inner race, its lines flanked at the speed, for it turns in and
out of the load looseness      a pedestal that lifts off once in two turns: half orders
misalignment   shafts that meet at an angle in a universal joint: torque at twice the speed
unbalance      for comparison: once a turn, and nothing else

python experiments/fault_signatures.py [--out DIR]
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from scipy.signal import butter, hilbert, sosfiltfilt

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label

SPEED = 300.0  # rad/s
TURN = 2 * np.pi / SPEED
GRAVITY = (0.0, -9.81, 0.0)


def disc(parts: dict, eccentricity: float = 1e-4, mass: float = 2.0) -> jr.Machine:
    """A disc on a spring that moves in x and y, turning steadily, and what else acts on it."""
    spring = jr.LinearSupport([2e5] * 2 + [0.0] * 4, [60.0] * 2 + [0.0] * 4)
    return held({"spring": spring} | parts, eccentricity, mass)


def held(parts: dict, eccentricity: float, mass: float) -> jr.Machine:
    return jr.Machine.in_line(
        {"disc": jr.Rotor(mass, 0.01, 0.006, unbalance=jr.Unbalance(eccentricity))},
        attachments={name: (part, "disc") for name, part in parts.items()},
        gravity=GRAVITY,
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(SPEED)}},
    )


def settled(machine: jr.Machine, turns: int, per_turn: int, drop: int) -> jr.Response:
    """A whole number of turns after the first `drop`."""
    run = jr.simulate(
        machine,
        (turns + drop) * TURN,
        per_turn / TURN,
        "undeformed",
        solver=jr.integrators.Rosenbrock(),
        rtol=1e-7,
    )
    return run


def last(values, turns: int, per_turn: int) -> np.ndarray:
    return np.asarray(values)[-turns * per_turn :]


def lines(values: np.ndarray, turns: int) -> tuple[np.ndarray, np.ndarray]:
    """Orders and amplitudes of a whole number of turns; nothing leaks."""
    sizes = np.abs(np.fft.rfft(values - values.mean())) * 2 / values.size
    return np.arange(sizes.size) / turns, sizes


def full(x: np.ndarray, y: np.ndarray, turns: int) -> tuple[np.ndarray, np.ndarray]:
    z = np.fft.fft((x - x.mean()) + 1j * (y - y.mean())) / x.size
    return np.fft.fftshift(np.fft.fftfreq(x.size, 1 / x.size)) / turns, np.fft.fftshift(np.abs(z))


def bearing(*defects) -> jr.RollingBearing:
    return jr.RollingBearing(
        stiffness=1e10, ball_diameter=8e-3, pitch_diameter=40e-3, clearance=2e-6, damping=600.0,
        defects=defects, balls=9,
    )  # fmt: skip


def envelope(machine: jr.Machine, turns: int) -> tuple[np.ndarray, np.ndarray]:
    """Orders in the envelope of the vertical acceleration, band-passed about the bearing's resonance."""
    per_turn = 512
    run = settled(machine, turns, per_turn, 10)
    a = last(run["disc"].acceleration[:, 1], turns, per_turn)
    band = butter(4, [20, 150], "bandpass", fs=per_turn, output="sos")  # orders
    return lines(np.abs(hilbert(sosfiltfilt(band, a))), turns)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/fault_signatures"), metavar="DIR")
    args = parser.parse_args()
    turns, per_turn = 32, 64

    fig, axes = figure(3, 2, (12, 11))
    found = {}

    def draw(ax, title, orders, sizes, scale, unit, highest, marks):
        keep = np.abs(orders) <= highest
        ax.vlines(orders[keep], 0, scale * sizes[keep], color=COLOURS[0], lw=1.4)
        top = scale * sizes[keep].max()
        for order, words in marks:
            ax.axvline(order, color=GREY, lw=0.7, ls="--", zorder=0)
            ax.annotate(words, (order, top * 1.02), ha="center", va="bottom", fontsize=8)
        ax.set_ylim(0, 1.14 * top)
        ax.set_xlim(-highest if orders.min() < 0 else 0, highest)
        label(ax, "times the speed", f"amplitude, {unit}")
        ax.set_title(title, fontsize=10, loc="left")

    for place, title, parts, eccentricity in (
        (axes[0, 0], "unbalance alone", {}, 1e-4),
        (axes[0, 1], "rub with friction", {"rub": jr.Rub(4e-4, 1e6, 0.05, 0.08, 0.2)}, 1e-4),
    ):
        run = settled(disc(parts, eccentricity), turns, per_turn, 200)
        x, y = (last(v, turns, per_turn) for v in (run["disc"].x, run["disc"].y))
        orders, sizes = full(x, y, turns)
        found[title] = orders, sizes
        marks = [(k, f"{k:+d}x") for k in (-2, -1, 1, 2)]
        draw(place, f"{title}: full spectrum", orders, sizes, 1e6, "um", 4.0, marks)

    rates = {k: float(v) for k, v in bearing().frequencies().items()}
    for place, name, defect in (
        (axes[1, 0], "outer", jr.elements.OuterRaceDefect(-np.pi / 2, 0.12, 6e-6)),
        (axes[1, 1], "inner", jr.elements.InnerRaceDefect(0.0, 0.12, 6e-6)),
    ):
        machine = held({"bearing": bearing(defect)}, 2e-6, 2.0)
        orders, sizes = envelope(machine, turns)
        found[name] = orders, sizes
        rate = rates[name]
        marks = [
            (k * rate, f"{k * rate:.4g}x" if k > 1 else f"{name} race {rate:.3g}x")
            for k in (1, 2, 3)
        ]
        draw(
            place,
            f"pit in the {name} race: spectrum of the envelope",
            orders,
            sizes,
            1.0,
            "m/s²",
            20.0,
            marks,
        )

    law = jr.elements.Bilinear(stiffness=1e4, other_stiffness=1e5, damping=30.0, other_damping=30.0)
    support = jr.LinearSupport([4e5] + [0.0] * 5, [60.0] + [0.0] * 5)
    run = settled(
        held({"foot": jr.LawSupport(y=law), "side": support}, 2e-4, 2.0), turns, per_turn, 200
    )
    orders, sizes = lines(last(run["disc"].y, turns, per_turn), turns)
    found["looseness"] = orders, sizes
    marks = [(k / 2, f"{k / 2:g}x") for k in range(1, 7)]
    draw(axes[2, 0], "loose pedestal: vertical motion", orders, sizes, 1e6, "um", 4.0, marks)

    joint = jr.Machine.in_line(
        {
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(SPEED)),
            "joint": jr.UniversalJoint(5e3, 2.0, np.deg2rad(10)),
            "fan": jr.Rotor(2.0, 0.005, 0.003),
        },
        attachments={"load": (jr.FanLoad(20.0 / SPEED**2), "fan")},
        fixed={"fan": ("x", "y", "z", "psi", "theta")},
    )
    run = settled(joint, turns, per_turn, 60)
    orders, sizes = lines(last(run["joint"].torque, turns, per_turn), turns)
    found["misalignment"] = orders, sizes
    marks = [(k, f"{k}x") for k in (1, 2, 3, 4)]
    draw(
        axes[2, 1],
        "shafts at 10 degrees: torque in the joint",
        orders,
        sizes,
        1.0,
        "N·m",
        5.0,
        marks,
    )

    for name, (orders, sizes) in found.items():
        largest = np.argsort(sizes)[::-1][:4]
        print(f"{name:20}", ", ".join(f"{orders[i]:+.3g}x {sizes[i]:.2e}" for i in largest))
    path = args.out / "fault_signatures.png"
    save_figure(fig, path)
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
