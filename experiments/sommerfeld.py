"""The Sommerfeld effect: a constant torque too weak to carry an unbalanced rotor past its critical speed.

A rigid rotor on springs is driven from rest by a constant torque T. Near the critical speed the whirl
takes power c W² r² out of the drive, the torque c W r: with 0.1 N·m the rotor is captured, with 0.2 N·m
it passes. The captured speed and amplitude are compared with the closed form T = c W r², and the
captured speed and the time of passage are differentiated by eccentricity, torque, stiffness and damping.

    python experiments/sommerfeld.py [--out results/sommerfeld] [--quick]

Machine: EXUDYN, Examples/rigidRotor3Drunup.py (github jgerstmayr/EXUDYN @e44aca1). Closed form: Kononenko,
Vibrating Systems with a Limited Power Supply (1969); Dimentberg et al., Nonlinear Dyn. 13 (1997) 171.
"""

import argparse
import functools
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import matplotlib

matplotlib.use("Agg")
import numpy as np
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.core.files import written_whole
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

MASS, POLAR, STIFFNESS, DAMPING, ECCENTRICITY = 2.0, 0.5625, 1600.0, 0.4525483399593904, 0.00148
TRANSVERSE = 0.25 * MASS * 0.75**2 + MASS * 0.2**2 / 12
CRITICAL = np.sqrt(STIFFNESS / MASS)  # rad/s
RATE = 100.0  # samples a second


def build(torque: float = 0.1) -> jr.Machine:
    """The rotor on its springs; it stays upright and in its plane."""
    lateral = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    return jr.Machine.in_line(
        {"rotor": jr.Rotor(MASS, POLAR, TRANSVERSE, unbalance=jr.Unbalance(ECCENTRICITY))},
        attachments={
            "springs": (jr.LinearSupport(STIFFNESS * lateral, DAMPING * lateral), "rotor"),
            "drive": (jr.Torque(torque), "rotor"),
        },
        fixed={"rotor": ("z", "psi", "theta")},
    )


def run(machine: jr.Machine, t_end: float, step: float = 2.5e-3) -> jr.Response:
    return jr.simulate(machine, t_end, RATE, step=step)


# The closed form: at constant speed W the centre whirls with radius r(W), and the damper takes c W r.


def radius(W, e=ECCENTRICITY, k=STIFFNESS, c=DAMPING):
    """Stationary amplitude of the geometric centre, m."""
    return MASS * e * W**2 / np.hypot(k - MASS * W**2, c * W)


def drag(W, e=ECCENTRICITY, k=STIFFNESS, c=DAMPING):
    """Torque that the stationary whirl takes from the drive, N·m."""
    return c * W * radius(W, e, k, c) ** 2


def captured_speed(torque, e=ECCENTRICITY, k=STIFFNESS, c=DAMPING) -> float:
    """Where `drag` holds the torque on the rising branch, rad/s."""
    return brentq(lambda W: drag(W, e, k, c) - torque, 1.0, np.sqrt(k / MASS), xtol=1e-14)


def slopes_of_captured_speed(torque: float) -> np.ndarray:
    """d(captured speed)/d(`NAMES`) by the closed form: from `drag(W, p) = torque` held as p changes."""
    at = np.array([ECCENTRICITY, torque, STIFFNESS, DAMPING])

    def gap(W, p):
        e, T, k, c = p
        r = MASS * e * W**2 / jnp.hypot(k - MASS * W**2, c * W)
        return c * W * r**2 - T

    W = captured_speed(torque)
    return -np.asarray(jax.grad(gap, 1)(W, jnp.asarray(at)) / jax.grad(gap, 0)(W, jnp.asarray(at)))


# What the runs are differentiated by; stiffness and damping are those of both lateral directions.
NAMES = ("eccentricity, m", "torque, N·m", "stiffness, N/m", "damping, N·s/m")


def with_values(p) -> jr.Machine:
    """The machine with eccentricity, torque, stiffness and damping `p`."""
    e, torque, k, c = p
    lateral = jnp.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    return build().set(
        {
            "rotor.unbalance.eccentricity": e,
            "drive.value.level": torque,
            "springs.stiffness": k * lateral,
            "springs.damping": c * lateral,
        }
    )


def settled(torque: float = 0.1, t_end: float = 1000.0) -> jr.Response:
    """From rest until the beats have died away: they fall by e in a minute."""
    return jr.simulate(build(torque), t_end, 1.0, step=5e-3)


def settled_speed(p, whirl: jr.State, t_end: float = 1000.0):
    """Speed in rad/s, `t_end` after a settled whirl. That start is held fixed: what it would have been
    with other values is forgotten by then, as it is by the machine."""
    return jr.simulate(with_values(p), t_end, 1.0, whirl, step=1e-2)["rotor"].speed[-1]


def time_of_passage(p, speed: float = 1.2 * CRITICAL, t_end: float = 130.0):
    """When the speed first reaches `speed`, s: between two samples time is a cubic in the speed."""
    response = run(with_values(p), t_end, step=5e-3)
    rotor = response["rotor"]
    i = jnp.argmax(rotor.speed > speed)
    (t, t_next), (W, W_next) = (x[jnp.stack([i - 1, i])] for x in (response.t, rotor.speed))
    slope, slope_next = (W_next - W) / rotor.acceleration[jnp.stack([i - 1, i]), 5]
    s = (speed - W) / (W_next - W)
    rest = (1 - s) * slope * s * (1 - s) - s * slope_next * s * (1 - s)
    return t * (1 - 3 * s**2 + 2 * s**3) + t_next * (3 * s**2 - 2 * s**3) + rest


def compare_slopes(title: str, quantity, p: np.ndarray, closed: np.ndarray | None = None) -> None:
    """Prints exact derivatives of `quantity` beside central differences and a closed form."""
    began = time.perf_counter()
    value, exact = jax.jit(lambda p: (quantity(p), jax.jacfwd(quantity)(p)))(jnp.asarray(p))
    function = jax.jit(quantity)
    print(f"\n{title}: {value:.6f}; derivatives ({time.perf_counter() - began:.0f} s):")
    more = "" if closed is None else f" {'closed form':>14} {'relative':>9}"
    print(f"{'by':>18} {'exact':>14} {'differences':>14} {'relative':>9}{more}")
    for i, name in enumerate(NAMES):
        h = 1e-4 * p[i] * np.eye(len(p))[i]
        near = (function(p + h) - function(p - h)) / (2e-4 * p[i])
        far = (function(p + 2 * h) - function(p - 2 * h)) / (4e-4 * p[i])
        central = float(4 * near - far) / 3
        row = f"{name:>18} {exact[i]:14.6g} {central:14.6g} {abs(central / exact[i] - 1):9.1e}"
        if closed is not None:
            row += f" {closed[i]:14.6g} {abs(closed[i] / exact[i] - 1):9.1e}"
        print(row)


TORQUES = dict(zip((0.05, 0.1, 0.15, 0.18, 0.2, 0.3), COLOURS))  # N·m
IN_PLANE = (0.1, 0.2)  # those drawn over speed


def run_all(torques=tuple(TORQUES), t_end: float = 200.0) -> jr.Response:
    """One run for each torque, as a batch."""
    machine = build()
    each = jax.jit(jax.vmap(lambda T: run(machine.set({"drive.value.level": T}), t_end)))
    return each(jnp.asarray(torques))


def draw(batch: jr.Response, out: Path) -> None:
    fig, ((left, right),) = figure(1, 2, (12.5, 5.0))
    W = np.linspace(18.0, 42.0, 4001)
    r = 1e3 * radius(W)
    rising = W <= W[np.argmax(drag(W))]
    right.plot(W[rising], r[rising], color=GREY, linewidth=6, alpha=0.35, label="captured branch")
    right.plot(W, r, color=GREY, linewidth=1.2, label="stationary whirl")
    for i, (torque, colour) in enumerate(TORQUES.items()):
        rotor = batch.member(i)["rotor"]
        speed = np.asarray(rotor.speed)
        left.plot(batch.t[i], speed, color=colour, linewidth=1.0, label=f"{torque:g} N·m")
        if torque in IN_PLANE:
            amplitude = 1e3 * np.hypot(rotor.x, rotor.y)
            name = f"run with {torque:g} N·m, 200 s"
            right.plot(speed, amplitude, color=colour, linewidth=1.0, label=name)
    at = captured_speed(0.1)
    right.plot(at, 1e3 * radius(at), "o", color="black", zorder=9, label="T = c W r², 0.1 N·m")
    left.axhline(CRITICAL, color=GREY, linewidth=1, linestyle="--")
    left.annotate("critical speed", (2, CRITICAL), (2, 3), textcoords="offset points", color=GREY)
    left.set_ylim(0, 80)
    right.set_xlim(W[0], W[-1])
    right.set_ylim(bottom=0)
    label(left, "time, s", "speed, rad/s", "A constant torque from rest: captured, or through")
    label(right, "speed, rad/s", "amplitude of the centre, mm", "Amplitude over speed")
    legend(left, loc="upper left", title="torque")
    legend(right, loc="upper right")
    with written_whole(out / "sommerfeld.png") as part:
        fig.savefig(part, dpi=110)


def table(batch: jr.Response) -> None:
    """Each torque's outcome, beside the speed and amplitude of the closed form."""
    print(
        f"{'torque':>10} {'speed at 200 s':>15} {'outcome':>10} {'if captured':>12} {'amplitude':>10}"
    )
    for i, torque in enumerate(TORQUES):
        speed = float(batch.member(i)["rotor"].speed[-1])
        outcome = "passes" if speed > CRITICAL else "captured"
        at = captured_speed(torque)
        far = speed < 0.9 * at
        outcome = "on its way" if far else outcome
        print(
            f"{torque:6g} N·m {speed:9.4f} rad/s {outcome:>10} {at:12.4f} {1e3 * radius(at):7.2f} mm"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/sommerfeld"))
    parser.add_argument("--quick", action="store_true", help="leave out the derivatives")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()

    print(
        f"Critical speed {CRITICAL:.3f} rad/s; {len(TORQUES)} runs of 200 s (compiling first) ..."
    )
    batch = run_all()
    table(batch)
    draw(batch, given.out)
    print(f"figure: {given.out / 'sommerfeld.png'}")

    at = np.array([ECCENTRICITY, 0.1, STIFFNESS, DAMPING])
    W = captured_speed(0.1)
    rotor = settled()["rotor"]
    print("\nCaptured by 0.1 N·m, settled after 1000 s:")
    for name, got, closed in (
        ("speed, rad/s", rotor.speed[-1], W),
        ("amplitude, m", np.hypot(rotor.x, rotor.y)[-1], radius(W)),
    ):
        print(
            f"{name:>14} {got:.12g}, closed form {closed:.12g}, relative {abs(got / closed - 1):.1e}"
        )
    if not given.quick:
        slopes = slopes_of_captured_speed(0.1)
        whirl = jr.State(rotor.position[-1:], rotor.velocity[-1:])
        quantity = functools.partial(settled_speed, whirl=whirl)
        compare_slopes("Captured speed at 0.1 N·m, rad/s", quantity, at, slopes)
        at[1] = 0.2
        compare_slopes("Time to 1.2 times the critical speed at 0.2 N·m, s", time_of_passage, at)
    print(f"\n{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
