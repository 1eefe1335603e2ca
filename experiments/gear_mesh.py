"""What makes gears whine: how stiff the mesh is over the engagement, and what tip relief does about it.

A spur and a helical pair of 28 and 35 teeth by their drawing. Drawn are the stiffness over two meshes after
Weber & Banaschek, with the eight harmonics that a run uses and ISO 6336's mean beside it, and how far the
transmission error swings over the tooth force, for three amounts of tip relief (a Harris map): each is quiet
near the force that it is cut for. It prints the swing's derivative by the relief beside central
differences.

    python experiments/gear_mesh.py [--out results/gear_mesh]

Sources: Weber & Banaschek, Schriftenreihe Antriebstechnik 11 (1953); ISO 6336-1:2006; Harris, Proc. IMechE
172 (1958) 87.
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

TEETH, MODULE, WIDTH = (28, 35), 3e-3, 30e-3
FORCE = 6000.0  # N: 200 N a mm of width
FORCES = np.linspace(500.0, 10000.0, 20)
RELIEFS = (0.0, 10e-6, 20e-6)
LENGTH = 5.8e-3  # along the line of action: almost down to where one pair is left


def pair(helix: float = 0.0, **more) -> jr.elements.GearPair:
    return jr.elements.GearPair(TEETH, MODULE, WIDTH, helix_angle=helix, **more)


def swing(relief, force):
    """Of the transmission error over one mesh, m, peak to peak."""
    gears = pair(tip_reliefs=jnp.stack([relief, relief]), relief_lengths=(LENGTH, LENGTH))
    return jnp.ptp(gears.loaded(force, 64).transmission_error)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/gear_mesh"))
    given = parser.parse_args()
    ((left, right),) = axes = figure(1, 2, (11.0, 4.6))[1]
    angles = np.linspace(0.0, 4 * np.pi, 401)
    k = np.arange(1, 9)
    for colour, name, helix in zip(COLOURS, ("spur", "helix 15 deg"), (0.0, np.radians(15.0))):
        gears = pair(helix)
        found = gears.mesh_stiffness(FORCE)
        waves = np.cos(k * angles[:, None] + found.phases) @ np.asarray(found.amplitudes)
        base = np.cos(float(gears.contact().base_helix))
        iso = float(gears.iso_stiffness().mesh) * WIDTH / base**2
        mean = float(found.mean)
        print(
            f"{name}: contact ratio {float(gears.contact_ratio()):.3f}, overlap "
            f"{float(gears.overlap_ratio()):.3f}, mean {mean:.4g} N/m, ISO 6336 {iso:.4g} N/m"
        )
        over = angles / (2 * np.pi)
        left.plot(over, np.asarray(gears.stiffness(FORCE, angles)) / 1e6, color=colour, label=name)
        left.plot(over, mean * (1 + waves) / 1e6, ":", color=colour, label="its 8 harmonics")
        left.axhline(iso / 1e6, ls="--", lw=1, color=colour, label="its mean by ISO 6336")
    label(left, "mesh angle, tooth pitches", "mesh stiffness, N/µm")
    left.set_ylim(0.0, None)
    legend(left, ncols=2, loc="lower center")
    map_ = jax.jit(lambda relief: jax.lax.map(lambda f: swing(relief, f), jnp.asarray(FORCES)))
    for colour, relief in zip(COLOURS, RELIEFS):
        found = np.asarray(map_(jnp.asarray(relief)))
        right.plot(FORCES / 1e3, found * 1e6, color=colour, label=f"tip relief {relief * 1e6:g} µm")
    label(right, "tooth force, kN", "transmission error, peak to peak, µm")
    right.set_ylim(0.0, None)
    legend(right)
    at = jnp.asarray(RELIEFS[1])
    slope = float(jax.jit(jax.grad(swing))(at, FORCE))
    near = [float(map_(at + d)[np.argmin(abs(FORCES - FORCE))]) for d in (1e-9, -1e-9)]
    print(f"swing by relief: {slope:.6f}; central differences {(near[0] - near[1]) / 2e-9:.6f}")
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(axes, given.out / "gear_mesh.png")
    print(given.out / "gear_mesh.png")


if __name__ == "__main__":
    main()
