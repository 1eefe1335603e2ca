"""The tuned torsional damper, by gradient, four ways: against the closed forms of a century.

A rotor on a torsion spring carries a `TorsionalDamper` (Den Hartog's absorber) of mass ratio mu. From a bad
start, 15 % out of tune and damped far too little, `jaxrotor.optimize` looks for its spring and its damper:

- the lowest resonance (a minimax of two peaks): Nishihara & Asami's exact optimum, not Den Hartog's fixed
  points, whose peaks are a little higher;
- the least vibration under white noise (H2): Crandall & Mark's, by the norm, and once more in time, by the
  squared twist after a blow, which is the same thing (Parseval) and needs no linear model;
- the fastest decay: by the decay rate itself, which has no slope where two pairs of poles meet, and by the
  mean of these poles under the condition that they meet, which is smooth;
- Lanchester's damper, which has no spring, and a quiet peak all the same.

It prints what was found beside the exact optimum, draws |H| over frequency for mu = 0.1, and writes
optima.json.

    python experiments/damper_den_hartog.py [--out results/damper_den_hartog]
"""

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.core.files import save_json
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

J, K = 0.04, 900.0  # kg*m^2, N*m/rad of the rotor and its spring
WN = float(np.sqrt(K / J))  # rad/s
TURN = "disc.phi"
AT = "undeformed"  # nothing loads it
MU = (0.01, 0.1, 0.2)
START = (0.85, 0.1)  # tuning, damping ratio
UNKNOWNS = [
    jr.Unknown("damper.stiffness", positive=True),
    jr.Unknown("damper.damping", positive=True),
]
# The run after a blow, s and Hz: long enough for all but 1e-7 of the squared twist, fine enough for its
# integral.
BLOW = {0.01: (2.4, 500.0), 0.1: (0.8, 1000.0), 0.2: (0.6, 1000.0)}


class Design(NamedTuple):
    """`found`, `exact`: the objective (of a rotor of unit stiffness and frequency) there and at the true
    optimum."""

    name: str
    mu: float
    found: float
    exact: float
    optimum: jr.optimization.Optimum
    seconds: float

    @property
    def tuning(self) -> float:
        """The damper's frequency by the rotor's."""
        return float(np.sqrt(self.optimum.machine.get("damper.stiffness") / (self.mu * J)) / WN)

    @property
    def damping(self) -> float:
        """c/(2 m w_n): by the rotor's frequency, so that Lanchester's has one too."""
        return float(self.optimum.machine.get("damper.damping") / (2 * self.mu * J * WN))

    @property
    def evaluations(self) -> int:
        return sum(map(len, self.optimum.history))


def build(mu: float, tuning: float, damping: float) -> jr.Machine:
    """`damping`: c/(2 m w_a), by the damper's own frequency."""
    own, w = mu * J, tuning * WN
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "spring": jr.Coupling([0.0, 0, 0, 0, 0, K]),
            "disc": jr.Rotor(1.0, J, 0.03),
        },
        attachments={
            "damper": (jr.TorsionalDamper(own, 2 * own * w * damping, own * w**2), "disc")
        },
        fixed={"disc": ("x", "y", "z", "psi", "theta")},
    )


def without_spring(mu: float, damping: float) -> jr.Machine:
    """`damping`: c/(2 m w_n)."""
    bare = {"damper.stiffness": 0.0, "damper.damping": 2 * mu * J * WN * damping}
    return build(mu, 1.0, 0.0).set(bare)


# The closed forms: tuning, damping ratio, objective


def den_hartog(mu):
    """Fixed points of equal height, Mechanical Vibrations, 4th ed., sec. 3.3. The height is that of the fixed
    points: the peaks beside them are higher."""
    return 1 / (1 + mu), np.sqrt(3 * mu / (8 * (1 + mu))), np.sqrt(1 + 2 / mu)


def nishihara_asami(mu):
    """J. Vib. Acoust. 124 (2002) 576."""
    r = np.sqrt(4 + 3 * mu)
    inside = 2 * (16 + 23 * mu + 9 * mu**2 + 2 * (2 + mu) * r) / (3 * (64 + 80 * mu + 27 * mu**2))
    height = ((8 + 9 * mu) ** 2 * (16 + 9 * mu) - 128 * r**3) / (3 * (32 + 27 * mu))
    return (
        2 / (1 + mu) * np.sqrt(inside),
        np.sqrt((8 + 9 * mu - 4 * r) / (1 + mu)) / 4,
        np.sqrt(height) / (3 * mu),
    )


def crandall_mark(mu):
    """Random Vibration (1963); the norm by the integral of |H|² for a system of fourth order."""
    f = np.sqrt((2 + mu) / 2) / (1 + mu)
    z = np.sqrt(mu * (4 + 3 * mu) / (8 * (1 + mu) * (2 + mu)))
    b0, b1, b2 = f**2, 2 * z * f, 1.0
    a0, a1, a2, a3 = f**2, 2 * z * f, 1 + f**2 * (1 + mu), 2 * z * f * (1 + mu)
    top = -a0 * a1 * b2**2 - a0 * a3 * (b1**2 - 2 * b0 * b2) + b0**2 * (a1 - a2 * a3)
    return f, z, np.sqrt(top / (2 * a0 * (a0 * a3**2 + a1**2 - a1 * a2 * a3)))


def nishihara_matsuhisa(mu):
    """Trans. JSME C 63 (1997) 3438: both pairs of poles coincide; the objective is their decay rate."""
    return 1 / (1 + mu), np.sqrt(mu / (1 + mu)), np.sqrt(mu / (1 + mu)) / 2


def lanchester(mu):
    """Den Hartog, sec. 3.3: no spring; damping by the rotor's frequency."""
    return 0.0, 1 / np.sqrt(2 * (1 + mu) * (2 + mu)), 1 + 2 / mu


# The designs


def _timed(name, mu, exact, measured, machine, *rest) -> Design:
    """`measured`: from an `Optimum` to the number that compares with `exact`."""
    began = time.perf_counter()
    found = jr.optimize(machine, *rest)
    return Design(name, mu, measured(found), exact, found, time.perf_counter() - began)


def _objective(found: jr.optimization.Optimum) -> float:
    return found.objective


def lowest_peaks(mu: float) -> Design:
    peaks = K * jr.objectives.ResponsePeaks(TURN, TURN, 0.0, 2 * WN, at=AT)
    exact = nishihara_asami(mu)[2]
    return _timed("H-infinity", mu, exact, _objective, build(mu, *START), UNKNOWNS, peaks)


def least_noise(mu: float) -> Design:
    norm = (K / np.sqrt(WN)) * jr.objectives.H2Norm(TURN, TURN, at=AT)
    exact = crandall_mark(mu)[2]
    return _timed("H2", mu, exact, _objective, build(mu, *START), UNKNOWNS, norm)


def least_after_a_blow(mu: float) -> Design:
    """A blow of 1 N·m·s sets the rotor, not the ring, turning; the integral of the squared twist is the H2
    norm's square. The exponential solver is exact for a linear machine, at any step."""
    still = jnp.zeros((2, 6))
    blown = jr.State(still, still.at[1, 5].set(1 / J), jnp.array([0.0, -1 / J]))
    end, rate = BLOW[mu]
    run = jr.optimization.SimulatedRun(end, rate, initial=blown, step=1 / rate, solver=jr.ETD4RK())
    square = (K**2 / WN) * run.measure(
        jr.objectives.Integral(jr.sensors.Twist("end", "disc"), power=2)
    )
    exact = crandall_mark(mu)[2]
    root = lambda found: np.sqrt(found.objective)  # noqa: E731
    return _timed("H2 in time", mu, exact, root, build(mu, *START), UNKNOWNS, square)


def fastest_decay(mu: float) -> Design:
    """As it stands: the search creeps along a crease that has no slope at its end."""
    slowest = (-1 / WN) * jr.objectives.DecayRate(at=AT)
    exact = nishihara_matsuhisa(mu)[2]
    back = lambda found: -found.objective  # noqa: E731
    return _timed("stability", mu, exact, back, build(mu, *START), UNKNOWNS, slowest)


def coalescing_poles(mu: float) -> Design:
    """The mean of both pairs of poles, which are to be one: smooth, and as good as Newton's method."""
    near = jnp.array([0.0, WN])
    mean = (1 / WN) * jr.objectives.PoleMean(near, at=AT)
    met = (1 / WN**2) * jr.objectives.PoleSpread(near, at=AT)
    exact = nishihara_matsuhisa(mu)[2]
    back = lambda found: -found.objective  # noqa: E731
    return _timed(
        "stability, smooth", mu, exact, back, build(mu, *START), UNKNOWNS, mean, [met.equal_to(0.0)]
    )


def no_spring(mu: float) -> Design:
    peak = K * jr.objectives.ResponsePeaks(TURN, TURN, 0.0, 2 * WN, 1, at=AT)
    exact = lanchester(mu)[2]
    return _timed(
        "Lanchester", mu, exact, _objective, without_spring(mu, START[1]), UNKNOWNS[1:], peak
    )


DESIGNS = (
    lowest_peaks, least_noise, least_after_a_blow, fastest_decay, coalescing_poles, no_spring,
)  # fmt: skip


def magnitude(machine: jr.Machine, g) -> np.ndarray:
    """|H|: twist by that of the same torque at rest, over frequency by the rotor's own."""
    return K * np.asarray(
        jr.frequency_response(machine, TURN, TURN, WN * g, at=AT).magnitude[:, 0, 0]
    )


def draw(designs: list[Design], mu: float):
    g = np.linspace(0.6, 1.4, 801)
    machines = {d.name: d.optimum.machine for d in designs if d.mu == mu}
    curves = [
        ("no damper", without_spring(mu, 0.0), GREY, ":"),
        ("Lanchester", machines["Lanchester"], COLOURS[4], "-"),
        ("fastest decay", machines["stability, smooth"], COLOURS[3], "-"),
        ("H2", machines["H2"], COLOURS[2], "-"),
        ("Den Hartog's fixed points", build(mu, *den_hartog(mu)[:2]), COLOURS[5], "-"),
        ("H-infinity", machines["H-infinity"], COLOURS[1], "--"),
    ]
    fig, axes = figure(1, 2, (12.0, 5.0))
    whole, close = axes[0]
    for name, machine, colour, style in curves:
        height = magnitude(machine, g)
        whole.plot(g, height, style, color=colour, label=name)
        if name in ("H2", "Den Hartog's fixed points", "H-infinity"):
            close.plot(g, height, style, color=colour, label=name)
    whole.set(yscale="log", ylim=(0.4, 60.0), xlim=(g[0], g[-1]))
    whole.set_yticks([0.5, 1, 2, 5, 10, 20, 50], ["0.5", "1", "2", "5", "10", "20", "50"])
    whole.minorticks_off()
    best = nishihara_asami(mu)[2]
    close.axhline(best, color="black", linewidth=0.8, label="the lowest peak there is")
    close.set(xlim=(0.8, 1.2), ylim=(0.75 * best, 1.25 * best))
    label(whole, "frequency / natural frequency", "|H|, twist / static twist", f"mass ratio {mu:g}")
    label(close, "frequency / natural frequency", "|H|, twist / static twist", "its peaks")
    legend(whole, loc="upper right")
    legend(close, loc="upper right")
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=Path("results/damper_den_hartog"),
        help="folder for response.png and optima.json (default: %(default)s)",
    )  # fmt: skip
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    print(
        f"{'design':18} {'mu':>5} {'found':>15} {'exact':>15} {'off':>9} {'tuning':>9} {'c/2mw':>9} "
        f"{'evaluations':>12} {'s':>6}"
    )
    designs = []
    for mu in MU:
        for design in DESIGNS:
            one = design(mu)
            designs.append(one)
            print(
                f"{one.name:18} {mu:5g} {one.found:15.10f} {one.exact:15.10f} "
                f"{one.found / one.exact - 1:9.1e} {one.tuning:9.6f} {one.damping:9.6f} "
                f"{one.evaluations:12d} {one.seconds:6.1f}"
            )
    print(
        "found, exact: of a rotor of unit stiffness and frequency; c/2mw: of the rotor's frequency"
    )
    save_json(
        out / "optima.json",
        {
            "rotor": {"inertia": J, "stiffness": K},
            "designs": [
                {"design": d.name, "mu": d.mu, "found": d.found, "exact": float(d.exact)}
                | {"tuning": d.tuning, "damping": d.damping, "seconds": d.seconds}
                | d.optimum.to_dict()
                for d in designs
            ],
        },
    )
    save_figure(draw(designs, 0.1), out / "response.png")
    print(f"{time.perf_counter() - began:.0f} s in all; response.png, optima.json in {out}/")


if __name__ == "__main__":
    main()
