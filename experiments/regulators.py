"""State feedback by gradient through the machine, and what it gains where the actuator saturates.

Two inertias on a shaft turn with a driven end, to which a soft coupling ties them. An active torque on the
first one brings them back into step when they are out of it; it feeds back both angles and both speeds
relative to the end. What it costs is the integral of both angles squared and R times the torque squared.

With an ideal actuator the best gains are those of the linear quadratic regulator (Riccati's equation), and
`jaxrotor.optimize` finds them through the machine. With an actuator that gives a small part of the torque
that these gains ask for, they are the best no more: gains found by gradient through the run itself, limit
included, serve it better. So that the regulator is not made to look worse than it is, the weight R for
which its gains serve the limited actuator best is looked for too. Costs are those of the torque that is
delivered, checked by runs of ten times finer a step.

    python experiments/regulators.py [--out results/regulators] [--limit 1.0] [--iterations 60]
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
from jaxrotor.commands.output import save_figure
from jaxrotor.core.files import save_json
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

SPEED = 80.0  # rad/s
INERTIAS = (0.04, 0.02)  # kg*m^2
COUPLING, SHAFT, DAMPING = 30.0, 400.0, 0.05  # N*m/rad, N*m*s/rad
Q = np.diag([1.0, 1.0, 0.0, 0.0])  # on rad², (rad/s)²
R = 1e-5  # on (N*m)²
LIMIT = 1.0  # N*m
OUT_OF_STEP = (0.1, 0.2)  # rad, both inertias: two runs, whose mean counts
T_END, RATE, STEP = 1.0, 500.0, 1e-3
NAMES = ("angle 1", "angle 2", "speed 1", "speed 2")
# Mean squares of the initial states by which the linear design is judged.
X0 = np.diag([0.02, 0.02, 8.0, 8.0])


def build(gains=(0.0,) * 4, limit: float | None = None) -> jr.Machine:
    def spring(k):
        return jr.Coupling(jnp.zeros(6).at[5].set(k), jnp.zeros(6).at[5].set(DAMPING))

    loop = jr.elements.ActiveTorque(
        jr.elements.StateFeedback(jnp.asarray(gains, float)),
        jr.elements.RelativeStates(3),
        jr.elements.Actuator(limit),
    )
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(SPEED)),
            "coupling": spring(COUPLING),
            "first": jr.Rotor(2.0, INERTIAS[0], 0.03),
            "shaft": spring(SHAFT),
            "second": jr.Rotor(1.0, INERTIAS[1], 0.02),
        },
        attachments={"loop": (loop, ("first", "second", "end"))},
        fixed={name: ("x", "y", "z", "psi", "theta") for name in ("first", "second")},
    )


def plant():
    """A and the column of the torque, x = (angles, speeds) relative to the end."""
    model = jr.linearize(build(), SPEED, at="undeformed")
    return np.asarray(model.A), np.asarray(model.B[:, [model.row("first.phi")]])


def lqr_gains(weight: float = R) -> np.ndarray:
    return np.asarray(jr.linear.lqr(*plant(), Q, [[weight]]).gain[0])


def unknowns() -> list[jr.Unknown]:
    scales = (100.0, 100.0, 5.0, 5.0)
    return [jr.Unknown(f"loop.controller.gains[{k}]", scale=s) for k, s in enumerate(scales)]


def gains_of(machine: jr.Machine) -> np.ndarray:
    return np.asarray(machine.get("loop.controller.gains"))


def linear_cost(machine: jr.Machine):
    """Of the controlled machine made linear: the mean over initial states `X0` of the cost for ever after."""
    A = jr.linearize(machine, SPEED, at="undeformed").A
    gains = machine.get("loop.controller.gains")
    whole = Q + R * jnp.outer(gains, gains)
    # the loop is closed already, inside A
    return jr.linear.closed_loop_cost(
        A, jnp.zeros((4, 1)), jnp.zeros((1, 4)), whole, jnp.eye(1), X0
    )


def out_of_step(angle: float) -> jr.State:
    position = jnp.zeros((3, 6)).at[1:, 5].set(angle)
    return jr.State(position, jnp.zeros((3, 6)).at[1:, 5].set(SPEED))


def run_cost(angles=OUT_OF_STEP, t_end: float = T_END, rate: float = RATE) -> jr.Criterion:
    """Of the machine as it runs: the mean over initial angles."""
    parts = []
    for angle in angles:
        run = jr.optimization.SimulatedRun(
            t_end, rate, initial=out_of_step(angle), step=STEP, solver=jr.ETD4RK()
        )
        for station in ("first", "second"):
            parts.append(
                run.measure(jr.objectives.Integral(jr.sensors.Twist("end", station), power=2))
            )
        parts.append(
            R * run.measure(jr.objectives.Integral(jr.sensors.Signal("loop", "torque"), power=2))
        )
    return (1 / len(angles)) * sum(parts[1:], parts[0])


def checked(machine: jr.Machine, angle: float, finer: int = 10, t_end: float = T_END):
    """A run of its own, of finer steps and samples: time, both angles, torque, cost (by Simpson's rule)."""
    from scipy.integrate import simpson

    found = jr.simulate(
        machine, t_end, finer * RATE, out_of_step(angle), step=STEP / finer, solver=jr.ETD4RK()
    )
    t = np.asarray(found.t)
    angles = [np.asarray(found[name].phi) - SPEED * t for name in ("first", "second")]
    torque = np.asarray(found["loop"].torque)
    cost = simpson(angles[0] ** 2 + angles[1] ** 2 + R * torque**2, x=t)
    return t, angles, torque, float(cost)


def mean_cost(machine: jr.Machine, finer: int = 10) -> float:
    return float(np.mean([checked(machine, angle, finer)[-1] for angle in OUT_OF_STEP]))


def linear_design() -> jr.optimization.Optimum:
    """From no feedback at all."""
    return jr.optimize(build(), unknowns(), linear_cost)


def limited_design(
    limit: float = LIMIT, iterations: int = 60, cost: jr.Criterion | None = None, gains=None
) -> jr.optimization.Optimum:
    """Through the run; by default from the regulator's gains."""
    start = build(lqr_gains() if gains is None else gains, limit)
    cost = run_cost() if cost is None else cost
    return jr.optimize(start, unknowns(), cost, iterations=iterations)


def best_weight(limit: float = LIMIT, weights=None) -> tuple[float, float]:
    """The weight R whose regulator serves the limited actuator best, and what that costs (by `R` itself)."""
    weights = np.geomspace(0.01 * R, 1000 * R, 21) if weights is None else weights
    costs = [mean_cost(build(lqr_gains(w), limit), finer=1) for w in weights]
    best = float(weights[int(np.argmin(costs))])
    return best, mean_cost(build(lqr_gains(best), limit))


def draw(machines: dict[str, jr.Machine], angle: float):
    fig, axes = figure(2, 1, (9.0, 6.5), sharex=True)
    above, below = axes[:, 0]
    styles = ((GREY, ":"), (COLOURS[1], "-"), (COLOURS[0], "-"))
    for (name, machine), (colour, style) in zip(machines.items(), styles):
        t, (_, angle_2), torque, _ = checked(machine, angle)
        above.plot(t, np.degrees(angle_2), style, color=colour, label=name)
        below.plot(t, torque, style, color=colour, label=name)
    limit = max(abs(below.get_lines()[-1].get_ydata()))
    below.set_ylim(-1.6 * limit, 1.6 * limit)
    label(above, "", "second inertia, degrees out of step")
    label(below, "time, s", "torque, N*m")
    legend(above)
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=Path("results/regulators"),
        help="folder for regulators.png and costs.json (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--limit", type=float, default=LIMIT, help="of the actuator, N*m (default: %(default)s)"
    )
    parser.add_argument(
        "--iterations", type=int, default=60,
        help="evaluations of the design under the limit, at most (default: %(default)s)",
    )  # fmt: skip
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    gains, cost_matrix = jr.linear.lqr(*plant(), Q, [[R]])
    gains, best = np.asarray(gains[0]), float(np.sum(cost_matrix * X0))
    print(f"ideal actuator, mean cost over initial states: {best:.9g} (LQR)")
    linear = linear_design()
    print(
        f"  tuned through the machine: {linear.objective:.9g} ({linear.objective / best - 1:+.1e})"
    )
    for name, a, b in zip(NAMES, gains, gains_of(linear.machine)):
        print(f"  gain of {name}: {a:.6g} (LQR), {b:.6g} (tuned)")
    asked = [abs(gains[:2].sum()) * angle for angle in OUT_OF_STEP]
    print(
        f"limit {given.limit:g} N*m, where the regulator asks for {asked[0]:.3g} and {asked[1]:.3g} N*m at "
        "first:"
    )
    tuned = limited_design(given.limit, given.iterations)
    machines = {
        "LQR, no limit": build(gains),
        "LQR, limited": build(gains, given.limit),
        "tuned under the limit": tuned.machine,
    }
    costs = {name: mean_cost(machine) for name, machine in machines.items()}
    weight, costs["LQR of the best R, limited"] = best_weight(given.limit)
    for name, cost in costs.items():
        gain = cost / costs["LQR, limited"] - 1
        print(f"  {name:27} {cost:.6g}   {100 * gain:+.1f} %")
    print(f"  best R of the regulator under the limit: {weight:.3g} (its own: {R:g})")
    print(
        f"  gains tuned under the limit: {', '.join(f'{g:.4g}' for g in gains_of(tuned.machine))}"
    )
    save_json(
        given.out / "costs.json",
        {
            "limit": given.limit,
            "linear": {"lqr": best, "tuned": linear.objective},
            "gains": {
                "lqr": gains.tolist(),
                "tuned": gains_of(linear.machine).tolist(),
                "tuned under the limit": gains_of(tuned.machine).tolist(),
            },
            "costs": costs,
            "best weight": weight,
            "design": tuned.to_dict(),
        },
    )
    save_figure(draw(machines, OUT_OF_STEP[0]), given.out / "regulators.png")
    print(f"{time.perf_counter() - began:.0f} s in all; regulators.png, costs.json in {given.out}/")


if __name__ == "__main__":
    main()
