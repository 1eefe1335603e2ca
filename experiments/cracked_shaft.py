"""A cracked shaft under weight: vibration twice per turn that grows with the depth of the crack.

A disc on a horizontal shaft between two bearings; a transverse crack beside the disc opens below and closes
above as the shaft turns (Mayes & Davies). For several depths the machine's steady whirl is found at each
speed by shooting, and its motion split into orders. Drawn are the vibration at twice per turn over
speed, resonant at half the critical speed, the orders of the deepest crack, and the orbits below half the
critical speed, with the loop inside that a diagnostician looks for. It prints the peaks, and the derivative
of the vibration by the crack's depth beside central differences.

    python experiments/cracked_shaft.py [--out results/cracked_shaft] [--quick]

Sources: Mayes & Davies, J. Vib. Acoust. 106 (1984) 139; Gasch, J. Sound Vib. 160 (1993) 313.
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

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

DEPTHS = (0.1, 0.2, 0.3)  # of the diameter
ORBITS_AT = 0.46  # of the critical speed
ORDERS = (1, 2, 3)
SAMPLES = 32  # in a turn
# For the derivative: what the disc does at twice per turn, m.
DEPTH, STEP = 0.2, 1e-4


def build(depth: float, speed: float) -> jr.Machine:
    """Motor, journal, disc, journal; the crack right of the disc."""

    def section(length, **more):
        return jr.Shaft(length, 0.02, rayleigh=(0.0, 4e-5), **more)

    def bearing():
        return jr.SelfAligningBearing(
            housing_mass=1.0, stiffness=5e7, damping=2e3, swing_damping=0.5
        )

    return jr.Machine.in_line(
        {
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(speed)),
            "stub": section(0.1),
            "left": bearing(),
            "shaft": section(0.3),
            "disc": jr.Rotor(10.0, 0.03, 0.017, unbalance=jr.Unbalance(5e-6)),
            "cracked": section(0.3, flaw=jr.elements.Crack(depth, position=0.05)),
            "right": bearing(),
        },
        {"air": (jr.LinearSupport(np.zeros(6), [20.0, 20.0, 0, 0, 0, 0]), "disc")},
        fixed={"right": ("z",)},
        gravity=(0.0, -9.81, 0.0),
    )


def orders(machine: jr.Machine, speed: float) -> tuple[jax.Array, jax.Array]:
    """The disc's steady orbit over a turn, complex x + iy, and its harmonics 0, 1, ..., -1, in m."""
    turn = 2 * np.pi / speed
    disc = jr.simulate(
        machine, turn, SAMPLES / turn, "steady", speed=speed, step=turn / 128, solver=jr.ETD4RK()
    )["disc"]
    orbit = (disc.x + 1j * disc.y)[:SAMPLES]
    return orbit, jnp.fft.fft(orbit) / SAMPLES


def size(harmonics, order: int):
    """The larger half axis of the ellipse at so many times per turn, m."""
    return abs(harmonics[order]) + abs(harmonics[-order])


def slope(critical: float) -> tuple[float, float]:
    """Of the vibration at twice per turn by the depth, m: exact, and by central differences."""
    speed = 0.48 * critical
    base = build(DEPTH, speed)

    def twice(depth):
        return size(orders(base.set({"cracked.flaw.depth": depth}), speed)[1], 2)

    exact = float(jax.jvp(twice, (jnp.asarray(DEPTH),), (jnp.ones(()),))[1])
    near, far = (
        float(twice(DEPTH + n * STEP) - twice(DEPTH - n * STEP)) / (2 * n * STEP) for n in (1, 2)
    )
    return exact, (4 * near - far) / 3


def smooth(orbit) -> np.ndarray:
    """The same orbit through more points, closed: its harmonics with none added."""
    spectrum = np.fft.fftshift(np.fft.fft(orbit))
    padded = np.fft.ifftshift(np.pad(spectrum, 8 * SAMPLES))
    fine = np.fft.ifft(padded) * padded.size / SAMPLES
    return np.append(fine, fine[0])


def draw(speeds, found, orbits, critical: float, out: Path) -> None:
    fig, axes = figure(1, 3, (15.0, 4.6))
    over, deepest, plane = axes[0]
    for colour, depth in zip(COLOURS, (0.0, *DEPTHS)):
        name = f"{depth:g} of the diameter" if depth else "sound"
        if depth:
            twice = 1e6 * np.array([size(h, 2) for h in found[depth]])
            over.semilogy(speeds / critical, twice, color=colour, label=name)
        orbit = 1e6 * smooth(orbits[depth])
        plane.plot(orbit.real, orbit.imag, color=colour, label=name, linewidth=1.2)
    for style, order in zip(("-", "--", ":"), ORDERS):
        of_it = 1e6 * np.array([size(h, order) for h in found[DEPTHS[-1]]])
        colour = COLOURS[len(DEPTHS)]
        deepest.semilogy(speeds / critical, of_it, style, color=colour, label=f"{order} per turn")
    for ax in (over, deepest):
        for part, name in ((1 / 3, "1/3"), (1 / 2, "1/2"), (1, "1")):
            ax.axvline(part, color=GREY, linewidth=0.8, linestyle="--")
            ax.annotate(name, (part, 1), (2, -9), ("data", "axes fraction"), "offset points")
    label(over, "speed / critical speed", "amplitude, µm", "Twice per turn, by depth of the crack")
    label(deepest, "speed / critical speed", "amplitude, µm", f"Crack of {DEPTHS[-1]:g}: orders")
    label(plane, "x, µm", "y, µm", f"Orbits at {ORBITS_AT:g} of the critical speed, sag included")
    plane.set_aspect("equal", adjustable="datalim")
    legend(over)
    legend(deepest)
    legend(plane, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    save_figure(fig, out / "cracked_shaft.png")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/cracked_shaft"))
    parser.add_argument("--quick", action="store_true", help="fewer speeds, no derivative")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()

    modes = jr.critical_modes(build(0.0, 100.0))
    critical = float(next(m.frequency for m in modes if m.name == "1 forward"))
    count = 18 if given.quick else 53
    speeds = np.linspace(0.28, 1.15, count) * critical
    print(f"Critical speed {critical:.2f} rad/s; {len(DEPTHS)} depths at {count} speeds ...")
    found = {a: [np.asarray(orders(build(a, w), w)[1]) for w in speeds] for a in DEPTHS}
    slow = ORBITS_AT * critical
    orbits = {a: np.asarray(orders(build(a, slow), slow)[0]) for a in (0.0, *DEPTHS)}
    sound = np.fft.fft(orbits[0.0]) / SAMPLES
    print(f"without a crack, twice per turn: {1e6 * size(sound, 2):.1e} µm")

    low = speeds < 0.75 * critical
    print(f"{'depth':>6} {'twice per turn, µm: peak':>26} {'at speed/critical':>18} {'at 0.75':>9}")
    for depth in DEPTHS:
        twice = 1e6 * np.array([size(h, 2) for h in found[depth]])
        at = int(np.argmax(np.where(low, twice, 0)))
        away = np.interp(0.75 * critical, speeds, twice)
        print(f"{depth:6g} {twice[at]:26.4f} {speeds[at] / critical:18.3f} {away:9.4f}")
    draw(speeds, found, orbits, critical, given.out)
    print(f"figure: {given.out / 'cracked_shaft.png'}")
    if not given.quick:
        exact, central = slope(critical)
        print(
            f"d(twice per turn)/d(depth) at {DEPTH:g}: {1e6 * exact:.8f} µm, central differences "
            f"{1e6 * central:.8f} µm, relative {abs(central / exact - 1):.1e}"
        )
    print(f"{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
