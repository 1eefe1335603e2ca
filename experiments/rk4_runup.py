"""A measured run-up through a critical speed: supports whose joints slip, and how far they are apart.

The rig of rk4_rig.py ran up from 1037 to 5003 rpm in a quarter of a minute. Known of it are the vectors of
one probe, revolution by revolution up to 2104 rpm, slow roll in them. A shaft of finite elements with its two
discs is met to them, on two alike supports, each a horizontal and a vertical spring beside a part that yields
the more the further it moves, and damps less then, as clamped joints do. The tracking filter's window is one
turn, as the record's; the speed is the record's own, smoothed. `Microslip` is a law of one's own, in fifteen
lines. What one probe cannot tell is not asked: both discs carry the same unbalance, both supports are alike.

    python experiments/rk4_runup.py [--out results/rk4_runup]

Each step of the search costs some fourteen runs of five seconds: a quarter of an hour in all.
"""

import argparse
import sys
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import matplotlib

matplotlib.use("Agg")
import numpy as np
from rk4_rig import DATA

sys.path.append(
    str(Path(__file__).parents[1] / "configs")
)  # where its study, rk4_rig.toml, finds the law

from microslip import Microslip

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.elements import KelvinVoigt, Parallel
from jaxrotor.plot.style import COLOURS, GREY, figure, label
from jaxrotor.sensors import Noise, ProximityProbe, TrackingFilter

DISC = dict(mass=0.8, polar_inertia=5.776e-4, transverse_inertia=3.305e-4)  # 76 by 25 mm
BETWEEN, OUTSIDE = 0.24, 0.04  # m: from disc to disc, from each to its probes
SPAN = 0.48  # m, as the source's mesh has it; elsewhere it says 0.56
LEAD = 0.4  # s that the run begins before the record, for its start to die away
STEP = 5e-5  # s: light journals on stiff joints
LAST = 2105.0  # rpm: up to here every revolution is in the record
RPM = np.pi / 30


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


def rotor(spin: jr.SpeedSpline, mark: float, span: float = SPAN) -> jr.Machine:
    """What is thought of it before: x is horizontal, y up, and the probe stands between."""
    springs = {}
    for axis, stiffness, slipping, damping, reach in (
        ("x", 6.0e4, 4.0e3, 40.0, 13e-6),
        ("y", 6.7e4, 6.5e4, 126.0, 8.2e-6),
    ):
        springs[axis] = Parallel([KelvinVoigt(stiffness, 0.0), Microslip(slipping, damping, reach)])
    outer = 0.5 * (span - BETWEEN) - OUTSIDE
    unbalance = jr.Unbalance(5.5e-6, -0.47 - mark)
    lengths = {
        "shaft 1": ("left", "plane 1", outer),
        "shaft 2": ("plane 1", "disc 1", OUTSIDE),
        "shaft 3": ("disc 1", "disc 2", BETWEEN),
        "shaft 4": ("disc 2", "plane 2", OUTSIDE),
        "shaft 5": ("plane 2", "right", outer),
    }
    stations = {name: jr.Node() for name in ("left", "plane 1", "plane 2", "right")}
    discs = {f"disc {k}": jr.Rotor(**DISC, unbalance=unbalance) for k in (1, 2)}
    shafts = {
        name: jr.FiniteElementShaft(length, 0.01, elements=1)
        for name, (*_, length) in lengths.items()
    }
    supports = {f"{side} support": jr.LawSupport(**springs) for side in ("left", "right")}
    return jr.Machine(
        stations | discs | shafts | supports,
        {name: ends for name, (*ends, _) in lengths.items()}
        | {f"{side} support": side for side in ("left", "right")},
        fixed={station: ["z"] for station in [*stations, *discs]},
        prescribed={"left": {"phi": spin}},
    )


def unknowns() -> list[jr.Unknown]:
    def alike(path: str, pair: tuple[str, str], **kind) -> jr.Unknown:
        first, second = (f"{one}.{path}" for one in pair)
        return jr.Unknown(first, also={second: 1.0}, **kind)

    supports, discs = ("left support", "right support"), ("disc 1", "disc 2")
    return [
        alike("length", ("shaft 1", "shaft 5"), positive=True),
        *(
            alike(f"{axis}.parts.{part}", supports, positive=True)
            for axis in "xy"
            for part in ("0.stiffness", "1.stiffness", "1.damping", "1.reach")
        ),
        alike("unbalance.eccentricity", discs, positive=True),
        alike("unbalance.angle", discs, circular=True),
        jr.Unknown("plane1_x.subtracted[0]", scale=1.0),
        jr.Unknown("plane1_x.subtracted[1]", scale=1.0),
    ]


def probe_of(mark: float, subtracted: list[float]) -> TrackingFilter:
    """plane1_x, half way between the axes; a window of one turn."""
    return TrackingFilter(
        ProximityProbe("plane 1", np.pi / 4),
        "left",
        mark=mark,
        lag=False,
        unit="um",
        subtracted=subtracted,
        noise=Noise(2.0),
    )


def identified(
    start: jr.Machine | None = None, spanning: bool = True, progress: bool | None = None
) -> jr.identification.Identification:
    """From what is thought of the rig before, or another `start`; `spanning`: whether the span is asked."""
    speeds, vectors, edges = measured()
    spin, mark = spin_of(speeds, edges)
    mark %= 2 * np.pi
    probe = probe_of(mark, [0.0, 6.0])  # less than nothing: slow roll is in the record
    inside = slice(1, -1)
    middles = 0.5 * (edges[1:] + edges[:-1])[inside]
    record = jr.Record({"plane1_x": jr.sensors.Series(middles, vectors[inside], "um")}, "run-up")
    run = jr.MeasuredRun(
        record, initial="undeformed", sample_rate=2000.0, step=STEP, solver=jr.ExponentialAdams()
    )
    return jr.identify(
        rotor(spin, mark) if start is None else start,
        unknowns()[0 if spanning else 1 :],
        {"plane1_x": probe},
        run,
        stages=[jr.Stage(jr.identification.Time(), 40)],
        progress=progress,
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
        law = getattr(found.machine["left support"], axis)
        force = np.array([float(law.force(0.0, d, 0.0, jnp.zeros(0))) for d in x])
        spring.plot(1e6 * x, 1e-3 * force / x, color=colour, label=words)
    label(spring, "displacement of a journal, um", "secant stiffness of a support, kN/m")
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
