"""A shaft with two stiffnesses: unstable between its critical speeds, shaken twice per turn by its weight.

A disc that keeps upright, on a shaft whose second moments of area are I (1 + ratio) and I (1 - ratio). Left:
over speed and asymmetry, how much the largest free motion grows in a turn (Floquet's multiplier, from
runs of one turn), and the edges of the unstable range by the closed form

    (1 - ratio - w²) (1 + ratio - w²) + (2 D w)² = 0,    w = speed / critical speed.

Right: the steady vibration at twice per turn under weight, found by shooting, on the closed form: a secondary
resonance at half the critical speed, and none at the critical speed itself. It prints the edges beside
the closed form.

    python experiments/asymmetric_shaft.py [--out results/asymmetric_shaft] [--quick]

Sources: Dimentberg, Flexural Vibrations of Rotating Shafts (1961), ch. 3; Friswell et al., Dynamics of
Rotating Machines (2010), sec. 7.4.
"""

import argparse
import time
from pathlib import Path

import equinox as eqx
import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

SPEED = 200.0  # rad/s: the machine keeps it, and its mass sets the critical speed
TURN = 2 * np.pi / SPEED
LENGTH, DIAMETER = 0.3, 0.012
STIFFNESS = 12 * jr.STEEL.youngs_modulus * np.pi / 64 * DIAMETER**4 / LENGTH**3
DAMPING_RATIO = 0.02
GRAVITY = 9.81


def build(w, ratio, gravity: float = 0.0) -> jr.Machine:
    """`w`: speed over critical speed, of the mean stiffness."""
    critical = SPEED / w
    mass = STIFFNESS / critical**2
    drag = 2 * DAMPING_RATIO * mass * critical * jnp.array([1.0, 1.0, 0, 0, 0, 0])
    motion = jr.ConstantSpeed(SPEED)
    return jr.Machine.in_line(
        {
            "motor": jr.PrescribedSpin(motion),
            "shaft": jr.Shaft(LENGTH, DIAMETER, flaw=jr.elements.Asymmetry(ratio)),
            "disc": jr.Rotor(mass, 0.02, 0.011),
        },
        {"air": (jr.LinearSupport(np.zeros(6), drag), "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": motion}},
        gravity=(0.0, -gravity, 0.0),
    )


def monodromy(w, ratio) -> jax.Array:
    """What a turn makes of small x, y, x', y'."""
    sizes = jnp.array([1e-6, 1e-6, 1e-4, 1e-4])

    def after(y):
        q = jnp.zeros((2, 6)).at[1, :2].set(y[:2])
        v = jnp.zeros((2, 6)).at[1, :2].set(y[2:])
        run = jr.simulate(
            build(w, ratio), TURN, 16 / TURN, jr.State(q, v), step=TURN / 96, solver=jr.ETD4RK()
        )["disc"]
        return jnp.concatenate([run.position[16, :2], run.velocity[16, :2]])

    return jax.vmap(after)(jnp.diag(sizes)).T / sizes


def growth(ws, ratios) -> np.ndarray:
    """Largest multiplier, (ratios, ws)."""
    grid = [jnp.asarray(x.ravel()) for x in np.meshgrid(ws, ratios)]
    found = np.asarray(eqx.filter_jit(jax.vmap(monodromy))(*grid))
    return np.abs(np.linalg.eigvals(found)).max(axis=1).reshape(len(ratios), len(ws))


def edges(ratio):
    """The closed form; NaN where damping keeps it stable at any speed."""
    p = 1 - 2 * DAMPING_RATIO**2
    inside = p**2 - (1 - np.asarray(ratio) ** 2)
    root = np.sqrt(np.where(inside >= 0, inside, np.nan))
    return np.sqrt(p - root), np.sqrt(p + root)


def found_edges(ratio: float) -> tuple[float, float]:
    """Where a run of one turn has the multiplier 1."""
    of = jax.jit(lambda w: jnp.linalg.det(monodromy(w, ratio) - jnp.eye(4)))
    low, high = edges(ratio)
    middle = 0.5 * (low + high)
    return (
        brentq(lambda w: float(of(w)), 0.9 * low, middle, xtol=1e-10),
        brentq(lambda w: float(of(w)), middle, 1.1 * high, xtol=1e-10),
    )


def twice_per_turn(w, ratio):
    """Over the sag of the mean stiffness: `A + ratio conj(B) = 1`,
    `(1 - 4 w² + 4 i D w) B + ratio conj(A) = 0`."""
    dynamic = 1 - 4 * w**2 + 4j * DAMPING_RATIO * w
    return np.abs(ratio / (dynamic - ratio**2))


def simulated(w: float, ratio: float) -> float:
    disc = jr.simulate(
        build(w, ratio, GRAVITY),
        TURN,
        32 / TURN,
        "steady",
        speed=SPEED,
        step=TURN / 128,
        solver=jr.ETD4RK(),
    )["disc"]
    order = np.fft.fft(np.asarray(disc.x + 1j * disc.y)[:32]) / 32
    mass = STIFFNESS * (w / SPEED) ** 2
    return abs(order[2]) / (mass * GRAVITY / STIFFNESS)


def draw(ws, ratios, multipliers, dots, out: Path) -> None:
    fig, ((left, right),) = figure(1, 2, (12.5, 4.8))
    shown = np.where(multipliers > 1 + 1e-9, multipliers, np.nan)
    map_ = left.pcolormesh(ws, ratios, shown, cmap="YlOrRd", shading="nearest", rasterized=True)
    fig.colorbar(map_, ax=left, label="growth in a turn")
    fine = np.linspace(0, ratios[-1], 2001)
    for side in edges(fine):
        line = left.plot(side, fine, color="black", linewidth=1.4)[0]
    line.set_label("closed form")
    left.set_xlim(ws[0], ws[-1])
    label(left, "speed / critical speed", "asymmetry (I1 - I2)/(I1 + I2)", "Unstable range")
    legend(left, loc="lower right")
    at = np.linspace(0.2, 1.2, 1001)
    for colour, (ratio, (w, amplitude)) in zip(COLOURS, dots.items()):
        right.semilogy(at, twice_per_turn(at, ratio), color=colour, linewidth=1, label=f"{ratio:g}")
        right.semilogy(w, amplitude, "o", color=colour, markersize=3.5)
    label(
        right,
        "speed / critical speed",
        "twice per turn / sag",
        "Under weight: dots simulated, lines closed form",
    )
    legend(right, title="asymmetry")
    save_figure(fig, out / "asymmetric_shaft.png")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/asymmetric_shaft"))
    parser.add_argument("--quick", action="store_true", help="a coarser map, fewer dots")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()

    columns, rows, count = (41, 21, 9) if given.quick else (121, 61, 25)
    ws, ratios = np.linspace(0.8, 1.2, columns), np.linspace(0.0, 0.3, rows)
    print(f"Runs of one turn at {columns * rows} speeds and asymmetries (compiling first) ...")
    multipliers = growth(ws, ratios)
    inside = np.zeros_like(multipliers, bool)
    for i, ratio in enumerate(ratios):
        low, high = edges(ratio)
        inside[i] = (ws > low) & (ws < high)
    print(f"stable or not as the closed form says: {np.mean(inside == (multipliers > 1)):.2%}")

    print(f"{'asymmetry':>10} {'edges found':>26} {'relative to the closed form':>30}")
    for ratio in (0.1,) if given.quick else (0.05, 0.1, 0.2):
        found, exact = np.array(found_edges(ratio)), np.array(edges(ratio))
        off = " ".join(f"{x:14.1e}" for x in found / exact - 1)
        print(f"{ratio:10g} {found[0]:13.9f}{found[1]:13.9f} {off:>30}")

    dots = {}
    for ratio in (0.02, 0.1):
        w = np.linspace(0.25, 0.85, count)
        dots[ratio] = (w, np.array([simulated(one, ratio) for one in w]))
        exact = twice_per_turn(*dots[ratio][:1], ratio)
        print(
            f"twice per turn under weight, asymmetry {ratio:g}: within "
            f"{np.max(np.abs(dots[ratio][1] / exact - 1)):.1e} of the closed form"
        )
    draw(ws, ratios, multipliers, dots, given.out)
    print(f"figure: {given.out / 'asymmetric_shaft.png'}")
    print(f"{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
