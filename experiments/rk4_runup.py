"""A measured run-up through a critical speed: supports whose joints slip.

The rig of rk4_rig.py ran up from 1037 to 5003 rpm in a quarter of a minute. Known of it are the vectors of
one probe, revolution by revolution up to 2104 rpm, slow roll in them. A modal rotor (both discs, first
bending) on a horizontal and a vertical spring is met to them: each spring has a part that yields the more the
further it moves, and damps less then, as clamped joints do. The tracking filter's window is one turn, as the
record's; the speed is the record's own, smoothed. `Microslip` is a law of one's own, in fifteen lines.

    python experiments/rk4_runup.py [--out results/rk4_runup]
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import matplotlib

matplotlib.use("Agg")
import numpy as np
from rk4_rig import DATA

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.elements import AbstractLaw, KelvinVoigt, Parallel
from jaxrotor.plot.style import COLOURS, GREY, figure, label
from jaxrotor.sensors import Noise, ProximityProbe, TrackingFilter

MASS = 1.6  # kg, of both discs: forces are known per mass alone
LEAD = 0.4  # s that the run begins before the record, for its start to die away
LAST = 2105.0  # rpm: up to here every revolution is in the record
RPM = np.pi / 30


class Microslip(AbstractLaw):
    """A joint that slips the more the further it moves: (k x + c v)/(1 + (x/reach)²)."""

    stiffness: jax.Array = jr.parameter("N*m/rad", positive=True)
    damping: jax.Array = jr.parameter("N*m*s/rad", nonnegative=True)
    reach: jax.Array = jr.parameter("rad", positive=True)

    def force(self, t, x, v, state):
        return (self.stiffness * x + self.damping * v) / (1 + (x / self.reach) ** 2)

    def energy(self, t, x, state):
        return 0.5 * self.stiffness * self.reach**2 * jnp.log1p((x / self.reach) ** 2)

    def power_lost(self, t, x, v, state):
        return self.damping * v**2 / (1 + (x / self.reach) ** 2)


def measured() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speeds (rad/s), vectors (um, 0-peak, lead) of single revolutions, instants of their pulses (s)."""
    rpm, um, degrees, _ = np.loadtxt(DATA / "runup_1x.csv", delimiter=",", skiprows=1, unpack=True)
    kept = rpm < LAST
    edges = LEAD + np.concatenate([[0.0], np.cumsum(60 / rpm[kept])])
    return rpm[kept] * RPM, (um * np.exp(1j * np.radians(degrees)))[kept], edges


def spin_of(speeds: np.ndarray, edges: np.ndarray) -> tuple[jr.SpeedSpline, float]:
    """The speed over time, reached back to the start of the run, and the shaft's angle at the pulses."""
    middles = 0.5 * (edges[1:] + edges[:-1])
    through = jr.SpeedSpline.smoothed(middles, speeds, lam=1e-2)
    t, w = np.asarray(through.times), np.asarray(through.speeds)
    first = w[0] - (w[-1] - w[0]) / (t[-1] - t[0]) * t[0]
    spin = jr.SpeedSpline(np.concatenate([[0.0], t]), np.concatenate([[first], w]))
    turned = np.asarray(jax.vmap(spin.position)(jnp.asarray(edges)))
    return spin, float(np.mean(turned - 2 * np.pi * np.arange(edges.size)))


def rotor(spin: jr.SpeedSpline, mark: float) -> jr.Machine:
    """What is thought of it before: x is horizontal, y up, and the probe stands between."""
    springs = {}
    for axis, rpm, slipping, damping, reach in (
        ("x", 1575.0, 2000.0, 6.0, 15e-6),
        ("y", 1620.0, 7000.0, 11.0, 24e-6),
    ):
        springs[axis] = Parallel(
            [
                KelvinVoigt(MASS * (rpm * RPM) ** 2, MASS * 2 * 0.005 * rpm * RPM),
                Microslip(MASS * slipping, MASS * damping, reach),
            ]
        )
    return jr.Machine(
        {
            "rotor": jr.Rotor(MASS, 1e-3, 1e-3, unbalance=jr.Unbalance(3.8e-6, -0.45 - mark)),
            "supports": jr.LawSupport(**springs),
        },
        {"supports": "rotor"},
        fixed={"rotor": ["z", "psi", "theta"]},
        prescribed={"rotor": {"phi": spin}},
    )


def unknowns() -> list[jr.Unknown]:
    laws = [
        f"supports.{axis}.parts.{part}"
        for axis in "xy"
        for part in ("0.stiffness", "1.stiffness", "1.damping", "1.reach")
    ]
    return [
        *(jr.Unknown(path, positive=True) for path in laws),
        jr.Unknown("rotor.unbalance.eccentricity", positive=True),
        jr.Unknown("rotor.unbalance.angle", circular=True),
        jr.Unknown("plane1_x.subtracted[0]", scale=1.0),
        jr.Unknown("plane1_x.subtracted[1]", scale=1.0),
    ]


def probe_of(mark: float, subtracted: list[float]) -> TrackingFilter:
    """plane1_x, half way between the axes; a window of one turn."""
    return TrackingFilter(
        ProximityProbe("rotor", np.pi / 4),
        "rotor",
        mark=mark,
        lag=False,
        unit="um",
        subtracted=subtracted,
        noise=Noise(2.0),
    )


def identified(progress: bool | None = None) -> jr.identification.Identification:
    speeds, vectors, edges = measured()
    spin, mark = spin_of(speeds, edges)
    mark %= 2 * np.pi
    probe = probe_of(mark, [0.0, 6.0])  # less than nothing: slow roll is in the record
    inside = slice(1, -1)
    middles = 0.5 * (edges[1:] + edges[:-1])[inside]
    record = jr.Record({"plane1_x": jr.sensors.Series(middles, vectors[inside], "um")}, "run-up")
    run = jr.MeasuredRun(
        record, initial="undeformed", sample_rate=2000.0, step=1e-4, solver=jr.ExponentialAdams()
    )
    stages = [jr.Stage(jr.identification.Time(), 60)]
    return jr.identify(
        rotor(spin, mark), unknowns(), {"plane1_x": probe}, run, stages=stages, progress=progress
    )


def misfit(found: jr.identification.Identification) -> float:
    """What is left of the vectors, as part of their size."""
    fit = found.channels[0]
    return float(np.linalg.norm(fit.residual) / np.linalg.norm(fit.measured))


def drawn(found: jr.identification.Identification) -> np.ndarray:
    """Amplitude, phase and what is left over, over speed; and the springs as they yield."""
    fit = found.channels[0]
    speeds = measured()[0][1:-1] / RPM
    _, axes = figure(2, 2, (14.0, 8.0))
    size, phase, rest, spring = axes.ravel()
    for panel, what in ((size, np.abs), (phase, lambda v: np.degrees(np.unwrap(np.angle(v))))):
        panel.plot(speeds, what(fit.measured), "o", color=GREY, markersize=4, label="measured")
        panel.plot(speeds, what(fit.simulated), color=COLOURS[0], label="identified")
    label(size, "speed, rpm", "amplitude, um 0-peak")
    label(phase, "speed, rpm", "phase (lead), degrees")
    size.legend(frameon=False)
    for part, words, colour in (
        (np.real, "real part", COLOURS[1]),
        (np.imag, "imaginary part", COLOURS[2]),
    ):
        left = part(fit.residual)
        rest.plot(speeds, left, "o-", color=colour, markersize=3, linewidth=0.7, label=words)
    label(rest, "speed, rpm", "left over, um")
    rest.legend(frameon=False)
    x = np.linspace(0.5e-6, 1e-4, 200)
    for axis, words, colour in (("x", "horizontal", COLOURS[0]), ("y", "vertical", COLOURS[3])):
        law = getattr(found.machine["supports"], axis)
        force = np.array([float(law.force(0.0, d, 0.0, jnp.zeros(0))) for d in x])
        spring.plot(1e6 * x, np.sqrt(force / x / MASS) / RPM, color=colour, label=words)
    label(spring, "displacement, um", "sqrt(k/m), rpm", "secant stiffness, as a critical speed")
    spring.legend(frameon=False)
    return axes


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/rk4_runup"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    found = identified()
    print(found)
    print(f"left over: {100 * misfit(found):.1f} % of the vectors")
    found.save(out / "identification.json")
    save_figure(drawn(found), out / "run_up.png")
    print(f"figure and table in {out}/ (jaxrotor {jr.__version__})")


if __name__ == "__main__":
    main()
