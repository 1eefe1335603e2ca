"""The film of a bearing of finite length: how the table that `JournalBearing(theory="finite")` uses was made.

Reynolds' equation is solved for eccentricities up to 0.95, lengths of 0.1 to 1.25 diameters and every
direction in which the journal may move: by cosines along the bearing (they do not mix, for the gap is the
same all along) and second-order differences around it, pressures below ambient cut off (Guembel). The force
over that of the short film, in closed form, is a complex number; its logarithm is fitted by `T_i(s)
T_j(length) eps^k cos k alpha` (and sines), s = sqrt(1 - eps²), alpha the direction. Prints how good the fit
is, and loads beside those of Raimondi & Boyd (ASLE Trans. 1 (1958) 159), whose film begins where pressure
and its slope vanish: that bears some 5 to 20 % more than a film cut off.

    python experiments/finite_film.py [--out DIR] [--table FILE]
"""

import argparse
import itertools
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from jaxrotor.commands.output import save_figure
from jaxrotor.elements.bearings.film import (
    DEGREES,
    LARGEST_RATIO,
    LENGTHS,
    finite_basis,
    finite_film,
    short_film,
)
from jaxrotor.plot.style import COLOURS, figure, label, legend

AROUND, MODES = 360, 16
ANGLES = 2 * np.pi * np.arange(AROUND) / AROUND
ALONG = np.linspace(0, 1, 41)  # half of the bearing
# Raimondi & Boyd: length over diameter -> eccentricity ratio -> Sommerfeld number.
PUBLISHED = {
    0.25: {0.1: 16.2, 0.2: 7.57, 0.4: 2.83, 0.6: 1.07, 0.8: 0.261, 0.9: 0.0736},
    0.5: {0.1: 4.31, 0.2: 2.03, 0.4: 0.779, 0.6: 0.319, 0.8: 0.0923, 0.9: 0.0313},
    1.0: {0.1: 1.33, 0.2: 0.631, 0.4: 0.264, 0.6: 0.121, 0.8: 0.0446, 0.9: 0.0188},
}

_short = jax.jit(short_film, static_argnums=2)


def pressures(eps: float, slenderness: float, around: int = AROUND) -> np.ndarray:
    """(2, around, 41): over 12 mu (R/c)², for w along the line of centres and across it."""
    angles = 2 * np.pi * np.arange(around) / around
    step = angles[1]
    cube, after = ((1 - eps * np.cos(angles + d)) ** 3 for d in (0.0, step / 2))
    before = np.roll(after, 1)
    found = np.zeros((2, around, ALONG.size))
    for m in range(MODES):
        k = (2 * m + 1) * np.pi / 2
        matrix = diags_array(
            [
                -(after + before) / step**2 - (k / slenderness) ** 2 * cube,
                after[:-1] / step**2,
                before[1:] / step**2,
                before[:1] / step**2,
                after[-1:] / step**2,
            ],
            offsets=[0, 1, -1, around - 1, 1 - around],
            format="csc",
        )
        solve = splu(matrix)
        share = 2 * (-1) ** m / k * np.cos(k * ALONG)
        for i, f in enumerate((np.cos(angles), np.sin(angles))):
            found[i] += np.outer(solve.solve(-f), share)
    return found


def force(pressure: np.ndarray, alpha: float) -> complex:
    """Radial and tangential force as one complex number, over the short film's unit."""
    p = np.maximum(np.cos(alpha) * pressure[0] + np.sin(alpha) * pressure[1], 0.0)
    mean = np.trapezoid(p, ALONG, axis=1)
    step = 2 * np.pi / mean.size
    return -step * np.sum(mean * np.exp(1j * 2 * np.pi * np.arange(mean.size) / mean.size))


def ratio(pressure: np.ndarray, eps: float, slenderness: float, alpha: float) -> complex:
    w = jnp.array([np.cos(alpha), np.sin(alpha)])
    short = np.asarray(_short(jnp.array([eps, 0.0]), w, True))
    return 3 * force(pressure, alpha) / complex(*short) / slenderness**2


def nodes(count: int, low: float, high: float) -> np.ndarray:
    return (low + high) / 2 + (high - low) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count)


def fit() -> tuple[np.ndarray, np.ndarray, float, float]:
    """Coefficients of the logarithm's real and imaginary part, and how far off the ratio is: largest, rms."""
    least = np.sqrt(1 - LARGEST_RATIO**2)
    alphas = np.pi * (np.arange(32) + 0.5) / 32  # the other half is its mirror image
    rows, values = [], []
    for s, length in itertools.product(nodes(14, least, 1.0), nodes(8, *LENGTHS)):
        eps = np.sqrt(1 - s**2)
        pressure = pressures(eps, length)
        for alpha in alphas:
            rows.append((eps, length, alpha))
            values.append(np.log(ratio(pressure, eps, length, alpha)))
    eps, lengths, alpha = np.array(rows).T
    basis = jax.vmap(finite_basis)
    at = (eps**2, lengths, eps * np.cos(alpha), eps * np.sin(alpha))
    even, odd = basis(*(jnp.asarray(x) for x in at))
    values = np.array(values)
    parts, off = [], np.zeros(values.size, complex)
    for design, part, unit in ((even, values.real, 1.0), (odd, values.imag, 1j)):
        design = np.asarray(design).reshape(values.size, -1)
        found = np.linalg.lstsq(design, part, rcond=1e-12)[0]
        off += unit * (design @ found - part)
        parts.append(found.reshape(even.shape[1:] if unit == 1.0 else odd.shape[1:]))
    error = np.abs(np.exp(off) - 1)
    return parts[0], parts[1], float(error.max()), float(np.sqrt(np.mean(error**2)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/finite_film"), metavar="DIR")
    parser.add_argument("--table", type=Path, help="write the coefficients there too")
    args = parser.parse_args()
    even, odd, worst, rms = fit()
    count = even.size + odd.size
    print(f"{count} coefficients, degrees {DEGREES}: off by {worst:.1%} at most, {rms:.2%} rms")
    if args.table:
        np.savez(args.table, even=even, odd=odd)
        print(f"wrote {args.table}: start Python anew to use it")
    film = jax.jit(finite_film)
    ratios = np.linspace(0.02, 0.95, 80)
    fig, axes = figure(1, 1, (8, 5.5))
    print(
        f"\n{'length':>7}{'eps':>6}{'published':>11}{'finite':>9}{'short':>9}   Sommerfeld number"
    )
    for colour, (length, published) in zip(COLOURS, PUBLISHED.items()):

        def load(eps, how, length=length):
            """Sommerfeld number of a journal that stays: w is half the speed, across."""
            f = how(jnp.array([eps, 0.0]), jnp.array([0.0, -0.5 * eps]), length)
            return 1 / (2 * np.pi * float(jnp.sqrt(f @ f)) * 2 * length**2)

        def short(eps, w, _):
            return _short(eps, w, True)

        for eps, number in published.items():
            print(f"{length:7}{eps:6}{number:11}{load(eps, film):9.3g}{load(eps, short):9.3g}")
        ax = axes[0, 0]
        ax.semilogy(
            ratios, [load(e, film) for e in ratios], color=colour, label=f"L/D = {length:g}"
        )
        ax.semilogy(ratios, [load(e, short) for e in ratios], color=colour, ls=":", lw=1)
        ax.semilogy([*published], [*published.values()], "o", color=colour, mfc="none")
    label(axes[0, 0], "eccentricity ratio", "Sommerfeld number (R/c)² μN/P")
    axes[0, 0].plot([], [], "k:", lw=1, label="short film")
    axes[0, 0].plot([], [], "ko", mfc="none", label="Raimondi & Boyd")
    legend(axes[0, 0])
    axes[0, 0].set_title("Load of a bearing of finite length", fontsize=10, loc="left")
    path = args.out / "finite_film.png"
    save_figure(fig, path)
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
