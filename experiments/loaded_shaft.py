"""A turning shaft under axial force and torque, up to buckling.

Left: whirl speeds of a pinned, turning shaft over its axial force, from the load that buckles it to twice as
much in tension, by finite elements on the closed form of a Timoshenko column that turns (u = U sin kz, slope
S cos kz, both e^(iwt)):

    (kGA k² + P k² - rA w²) (EI k² + kGA - rI (w² - 2 W w)) = (kGA k)²

At the buckling load (Engesser's, below Euler's, for the shaft yields to shear) the first backward whirl comes
to rest. Right: thrust and torque that buckle it together, by `jr.linear.buckling_factor` along rays, for the
three kinds of moment at its ends, with Greenhill's parabola (T/2EI)² + P/EI = (pi/L)² for axial ones. It
prints the worst error of each against its closed form.

    python experiments/loaded_shaft.py [--out results/loaded_shaft]

Sources: Greenhill, Proc. Inst. Mech. Eng. (1883) 182; Ziegler, Principles of Structural Stability (1968);
Zorzi & Nelson, J. Mech. Des. 102 (1980) 158.
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

LENGTH, DIAMETER, BORE = 0.3, 0.04, 0.03  # m, of a fast spindle
STEEL = jr.Material.named("42CrMo4")
SPEED = 12_000.0  # rad/s
E, G, RHO = (float(x) for x in (STEEL.youngs_modulus, STEEL.shear_modulus, STEEL.density))
AREA = np.pi / 4 * (DIAMETER**2 - BORE**2)
MOMENT = np.pi / 64 * (DIAMETER**4 - BORE**4)
EULER = np.pi**2 * E * MOMENT / LENGTH**2
NU, M2 = E / G / 2 - 1, (BORE / DIAMETER) ** 2
KAPPA = 6 * (1 + NU) * (1 + M2) ** 2 / ((7 + 6 * NU) * (1 + M2) ** 2 + (20 + 12 * NU) * M2)
YIELDING = KAPPA * G * AREA
ENGESSER = EULER / (1 + EULER / YIELDING)  # what buckles it where it yields to shear


def build(kind: str = "axial", slender: bool = False, elements: int = 16) -> jr.Machine:
    """Pinned and driven; `slender`: without shear and rotary inertia."""
    shaft = jr.FiniteElementShaft(
        LENGTH,
        DIAMETER,
        BORE,
        material=STEEL,
        elements=elements,
        shear=not slender,
        rotary_inertia=not slender,
        axial_force=0.0,
        torque=0.0,
        torque_kind=kind,  # pyright: ignore[reportArgumentType]
    )
    return jr.Machine.in_line(
        {"left": jr.Node(), "shaft": shaft, "right": jr.Node()},
        fixed={"left": ("x", "y", "z"), "right": ("x", "y")},
        prescribed={"left": {"phi": jr.ConstantSpeed(SPEED)}},
    )


def column(waves: int, force: float) -> np.ndarray:
    """Whirl of the closed form, rad/s, rising; backward ones negative."""
    k = waves * np.pi / LENGTH

    def gap(w):
        a = (YIELDING + force) * k**2 - RHO * AREA * w**2
        b = E * MOMENT * k**2 + YIELDING - RHO * MOMENT * (w**2 - 2 * SPEED * w)
        return a * b - (YIELDING * k) ** 2

    x = np.linspace(-1, 1, 5)
    roots = 1e5 * np.polynomial.Polynomial.fit(x, gap(1e5 * x), 4).roots()
    return np.sort(roots[abs(roots.imag) < 1e-6 * abs(roots)].real)


def slowest(roots: np.ndarray) -> np.ndarray:
    """Backward and forward."""
    return np.array([max(roots[roots < 0]), min(roots[roots > 0])])


def whirl(machine: jr.Machine, force: float) -> np.ndarray:
    """|w| of the lateral modes, rad/s, rising."""
    model = jr.linearize(machine.set({"shaft.axial_force": force}), SPEED, at="undeformed")
    return np.array([m.frequency for m in jr.modes(model, 12) if m.kind == "lateral"])


def over_force(axes) -> float:
    """Worst error of whirl against the closed form."""
    machine, worst = build(), 0.0
    fine, coarse = np.linspace(-0.9999, 2.0, 300), np.array([-0.97, -0.8, -0.5, 0, 0.5, 1, 1.5, 2])
    for waves, colour in ((1, COLOURS[0]), (2, COLOURS[1])):
        exact = np.abs([slowest(column(waves, x * ENGESSER)) for x in fine])
        for side, (style, way) in enumerate((("--", "backward"), ("-", "forward"))):
            words = f"{way}, {waves} half wave{'s' * (waves > 1)}"
            axes.plot(fine, exact[:, side], style, color=colour, label=words)
    for x in coarse:
        found = whirl(machine, x * ENGESSER)
        for waves in (1, 2):
            exact = np.abs(slowest(column(waves, x * ENGESSER)))
            mine = np.array([found[np.argmin(abs(found - w))] for w in exact])
            worst = max(worst, float(np.max(abs(mine / exact - 1))))
            axes.plot([x, x], mine, "o", ms=4, color=COLOURS[waves - 1])
    axes.plot([], [], "o", ms=4, color="grey", label="16 elements")
    axes.set_ylim(0, None)
    label(axes, "axial force over the buckling load", "whirl, rad/s")
    axes.set_title(f"Pinned shaft at {SPEED:g} rad/s", loc="left")
    legend(axes)
    return worst


def together(axes) -> tuple[float, float]:
    """Errors of Greenhill's parabola, and of the torque alone with semi-tangential ends."""
    unit = E * MOMENT / LENGTH
    torque = np.linspace(0, 1, 100)
    axes.plot(1 - torque**2, 2 * np.pi * torque, color=COLOURS[0], label="Greenhill, axial moments")
    alone = 2 * brentq(lambda a: np.tan(a) + a / 3, 1.6, 3.1)
    axes.plot(
        [0], [alone], "x", ms=9, mew=2, color=COLOURS[2], label="closed form, semi-tangential"
    )
    worst, other = 0.0, 0.0
    for kind, mark, colour in (
        ("axial", "o", 0),
        ("follower", "^", 1),
        ("semi-tangential", "s", 2),
    ):
        machine, points = build(kind, slender=True), []
        for angle in np.linspace(0, np.pi / 2, 7):
            thrust, twist = np.cos(angle), 2 * np.pi * np.sin(angle)
            loads = {"shaft.axial_force": -thrust * EULER, "shaft.torque": twist * unit}
            factor = float(jr.linear.buckling_factor(machine.set(loads)))
            points.append((factor * thrust, factor * twist))
        x, y = np.array(points).T
        axes.plot(x, y, mark, ms=5, color=COLOURS[colour], label=f"16 elements, {kind}")
        if kind == "axial":
            worst = float(np.max(abs(x + (y / (2 * np.pi)) ** 2 - 1)))
        if kind == "semi-tangential":
            other = float(abs(y[-1] / alone - 1))
    label(axes, "thrust over Euler's load", "torque over EI/L")
    axes.set_title("Buckling under both", loc="left")
    legend(axes)
    return worst, other


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/loaded_shaft"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    ((left, right),) = axes = figure(1, 2, (11.0, 4.6))[1]
    print(f"whirl against the closed form: {over_force(left):.1e}")
    parabola, alone = together(right)
    print(f"Greenhill's parabola: {parabola:.1e}; semi-tangential torque alone: {alone:.1e}")
    save_figure(axes, given.out / "loaded_shaft.png")
    print(f"Figure in {given.out}")


if __name__ == "__main__":
    main()
