"""The start-up of the two-rotor machine of Matyja & Łazarz (2014), from Python.

Runs the machine for ten seconds, draws the paper's figures, checks what the paper observed, compares
the paper's twist law with the invariant one, and differentiates the passage's peak amplitude by every
unbalance parameter and every section length.

    python experiments/two_rotor_startup.py [--out results/experiment] [--quick]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import matplotlib

matplotlib.use("Agg")
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.observations import observation_table, observations
from jaxrotor.commands.run_report import summary_table, write_report
from jaxrotor.diagnostics.spectrum import power_spectral_density
from jaxrotor.plot.style import COLOURS, band, figure, label, legend

SECTIONS = {"shaft 1": 0.060, "shaft 2": 0.080, "shaft 3": 0.127, "shaft 4": 0.020}


def build(twist: str = "paper") -> jr.Machine:
    """The machine, from left to right."""

    def shaft(name):
        return jr.Shaft(SECTIONS[name], diameter=0.012, rayleigh=(0.002, 0.002), twist=twist)

    bearing = dict(
        housing_mass=1.0, stiffness=1e6, damping=200.0, swing_damping=5.0, friction_arm=0.002
    )
    return jr.Machine.in_line(
        {
            "second": jr.Rotor(3.0935, 0.00485, 0.002837, unbalance=jr.Unbalance(1e-5)),
            "shaft 1": shaft("shaft 1"),
            "left": jr.SelfAligningBearing(**bearing),
            "shaft 2": shaft("shaft 2"),
            "main": jr.Rotor(
                6.0788, 0.01873, 0.01018, unbalance=jr.Unbalance(5e-4, inclination=np.deg2rad(1))
            ),
            "shaft 3": shaft("shaft 3"),
            "right": jr.SelfAligningBearing(**bearing),
            "shaft 4": shaft("shaft 4"),
            "end": jr.PrescribedSpin(jr.CosineRamp(speed=1000.0, duration=2.5)),
        },
        gravity=(0.0, -9.81, 0.0),
    )


def compare_twist_laws(runs: dict[str, jr.Response], out: Path) -> None:
    """What the invariant law changes in the paper's Figures 17-19, in numbers and one picture."""
    t = np.asarray(next(iter(runs.values())).t)
    fig, axes = figure(3, 2, (13, 9.5))
    print(
        f"{'':>10} {'law':>10} {'speed diff. peak, rms':>24} {'accel. diff. peak, rms':>26}  lines, Hz"
    )
    for column, name in enumerate(("main", "second")):
        for colour, (law, run) in zip(COLOURS, runs.items()):
            speed = np.asarray(run[name].speed - run["end"].speed)
            accel = np.asarray(run[name].acceleration[:, 5] - run["end"].acceleration[:, 5])
            f, density = power_spectral_density(speed, 1 / (t[1] - t[0]))
            inner = (density[1:-1] > density[:-2]) & (density[1:-1] > density[2:])
            lines = 1 + np.flatnonzero(inner)
            lines = lines[np.argsort(-density[lines])][:3]
            print(
                f"{name:>10} {law:>10} {np.abs(speed).max():12.4f} {speed.std():.5f} rad/s"
                f" {np.abs(accel).max():11.2f} {accel.std():8.3f} rad/s²  "
                + ", ".join(f"{f[k]:.0f} ({density[k]:.1e})" for k in lines)
            )
            band(axes[0, column], t, speed, colour, law)
            band(axes[1, column], t, accel, colour, law)
            axes[2, column].semilogy(f[1:], density[1:], color=colour, linewidth=0.9, label=law)
        label(axes[0, column], "time, s", "rad/s", f"`{name}` less drive: speed (Fig. 17)")
        label(axes[1, column], "time, s", "rad/s²", f"`{name}` less drive: acceleration (Fig. 18)")
        label(
            axes[2, column], "frequency, Hz", "(rad/s)²/Hz", "PSD of the speed difference (Fig. 19)"
        )
        axes[2, column].set_ylim(bottom=1e-16)
    legend(axes[0, 0], loc="upper right")
    fig.savefig(out / "twist_laws.png", dpi=150)


def differentiate_peak(machine: jr.Machine, out: Path) -> None:
    """d(peak radial amplitude of main)/d(unbalance, lengths), exact and by differences."""
    paths = [
        f"{rotor}.unbalance.{field}"
        for rotor in ("main", "second")
        for field in ("eccentricity", "angle", "inclination", "inclination_angle")
    ]
    paths += [f"{name}.length" for name in SECTIONS]
    t_end, rate = 1.3, 1000.0  # the peak is at 1.063 s
    plan = jr.plan(machine, t_end, rate)

    def peak(values):
        run = jr.simulate(machine.set(dict(zip(paths, values))), t_end, rate, step=plan)
        return jnp.max(jnp.hypot(run["main"].x, run["main"].y))

    at = jnp.stack([machine.get(path) for path in paths])
    began = time.perf_counter()
    value, gradient = jax.jit(jax.value_and_grad(peak))(at)
    print(
        f"peak {1e3 * value:.6f} mm; gradient with compiling {time.perf_counter() - began:.1f} s\n"
    )
    function = jax.jit(peak)
    print(f"{'parameter':>32} {'value':>10} {'gradient':>15} {'differences':>15} {'relative':>9}")
    central = []
    for i, (path, x) in enumerate(zip(paths, np.asarray(at))):
        # a step that moves the peak by about a thousandth: sixth-order differences, no rounding
        slope = abs(float(gradient[i]))
        h = np.clip(1e-3 * float(value) / (slope + 1e-300), 1e-8, 2e-2 if x == 0 else 2e-2 * x)
        if path.endswith("angle"):
            h = 1e-2

        def moved(s, i=i, h=h):
            return float(function(at.at[i].add(s * h)))

        d = 45 * (moved(1) - moved(-1)) - 9 * (moved(2) - moved(-2)) + (moved(3) - moved(-3))
        central.append(d / (60 * h))
        scale = max(slope, 1e-12)
        print(
            f"{path:>32} {x:10.4g} {float(gradient[i]):15.7e} {central[-1]:15.7e} "
            f"{abs(central[-1] - float(gradient[i])) / scale:9.1e}"
        )
    # per mm of length or eccentricity, per mrad of angle, in micrometres
    share = 1e3 * np.asarray(gradient)
    fig, ((ax,),) = figure(1, 1, (9, 5.5))
    ax.barh(
        range(len(paths)), share, color=[COLOURS[0] if "length" in p else COLOURS[1] for p in paths]
    )
    ax.set_yticks(range(len(paths)), paths)
    ax.invert_yaxis()
    ax.set_xscale("symlog", linthresh=1e-2)
    label(
        ax,
        "change of main's peak amplitude, µm per mm (or per mrad)",
        "",
        "Sensitivity of the passage",
    )
    fig.savefig(out / "sensitivity.png", dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/experiment"))
    parser.add_argument("--quick", action="store_true", help="leave out the gradient")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()

    print("The start-up, twice (compiling takes some seconds) ...")
    runs = {law: jr.simulate(build(law), 10.0, 1000.0) for law in ("paper", "invariant")}
    print(summary_table(runs["paper"]))
    found = observations(runs["paper"])
    print(f"\nWhat the paper observed:\n{observation_table(found)}")
    extra = {"observations": [o._asdict() for o in found]}
    files = write_report(None, runs["paper"], given.out, extra)
    print(f"\n{len(files)} files in {given.out}/\n\nThe invariant twist law beside the paper's:")
    compare_twist_laws(runs, given.out)
    if not given.quick:
        print("\nd(peak radial amplitude of main)/d(parameter), SI:")
        differentiate_peak(build(), given.out)
    print(f"\n{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
