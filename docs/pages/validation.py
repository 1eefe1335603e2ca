"""docs/validation.md: every published case, as printed and as the program gives it.

    python docs/pages/validation.py          # the quick cases, compared with the page
    python docs/pages/validation.py --write  # all of them, some minutes; writes the page

Machines and printed numbers are those that the tests compare (tests/). tests/test_site.py has the quick cases
computed anew; the others stay as they were written last.
"""

import dataclasses
import os
import re
import sys
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
if __name__ == "__main__":
    os.environ["JAX_ENABLE_X64"] = "1"
    sys.path[:0] = [str(ROOT / "src"), str(ROOT / "docs")]

import numpy as np

from pages import published

PAGE = ROOT / "docs" / "validation.md"


@dataclasses.dataclass
class Case:
    """`rows`: (quantity, printed, ours) each; `argued`: what is to be said of differences."""

    title: str
    source: str
    rows: Callable[[], list[tuple[str, Any, Any]]]
    argued: str = ""
    quick: bool = True  # a second or three: computed anew by the tests

    def table(self) -> list[tuple[str, ...]]:
        return [_row(*row) for row in self.rows()]


def _row(what: str, printed: Any, ours: Any) -> tuple[str, ...]:
    """Ours with one digit more than what is printed."""
    if isinstance(printed, complex) or isinstance(ours, complex):
        gap = abs(complex(ours) - complex(printed)) / abs(complex(printed))
        return what, _complex(printed, 3), _complex(ours, 4), f"{gap:.1e}"
    if isinstance(printed, str) and not re.fullmatch(r"[-+\d.e]+", printed):
        return what, printed, str(ours), "-"
    text = printed if isinstance(printed, str) else repr(float(f"{float(printed):.10g}"))
    digits = len(re.sub(r"e.*|[-+.]", "", text).lstrip("0")) or 1
    value, wanted = float(ours), float(printed)
    gap = abs(value - wanted) if wanted == 0 else abs(value / wanted - 1)
    return what, text, f"{value:.{min(digits + 1, 12)}g}", f"{gap:.1e}"


def _complex(value: complex, digits: int) -> str:
    value = complex(value)
    real = round(value.real, digits) + 0.0  # no -0.000
    return f"{real:.{digits}f} {'+' if value.imag >= 0 else '-'} {abs(value.imag):.{digits}f}i"


CASES = {
    "Rotors, linear": [
        Case("Two-disc rotor on isotropic bearings",
             "Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), Ex. 5.9.1, as ROSS prints it",
             published.two_disc_rotor,
             "The same Timoshenko elements, so every digit is asked. 650.40786626 rad/s is the shaft's first free torsional mode.",
             quick=False),
        Case("Overhung rotor, nine pairs of bearings, and its critical speeds",
             "Friswell et al. (2010), Ex. 6.8.1 and 6.9.1, Tables 6.3 and 6.4", published.overhung_rotor,
             "To half of the last printed digit. Real parts are printed to three decimals: where they are near zero their own "
             "difference is all rounding.", quick=False),
        Case("Synchronous machines at their rated load, and constants from a data sheet",
             "Krause, Wasynczuk & Sudhoff, Analysis of Electric Machinery and Drive Systems, ch. 5; Kundur 1994, ex. 4.1",
             published.synchronous_machines, "To the digits printed; the book's text was not at hand, its data and results "
             "are as they are commonly quoted."),
        Case("Overhung disc on a shaft without mass", "Stodola 1927, Green 1948; closed form", published.stodola_green),
        Case("Onset of instability by rotating damping", "Genta; Vance: w0 (1 + external/internal)", published.onset, quick=False, argued=
             "The paper's own beta = 0.002 s, read as damping that turns with the shaft, would make its machine unstable soon above its "
             "critical speed; read in the fixed frame, as here by default, it does not ([shaft section](physics.md#shaft-section))."),
        Case("Beams and bars", "Genta 2008, p. 286; Rao: closed forms", published.beams,
             "The meshes' own errors, no more: (beta h)⁴/1440 of 16 cubic elements in bending, (beta h)²/24 of 20 linear ones in "
             "torsion and tension. The second bending mode of eight cubic elements would miss 1e-4 by this law, whoever wrote them.", quick=False),
        Case("Shafts under thrust and torque",
             "Euler; Greenhill 1883; Beck 1955 and Ziegler 1968: closed forms", published.loads,
             "16 elements, from above by (n pi h/L)⁴/720. The moment at the ends decides: axial, fixed in space, or semi-tangential.", quick=False),
        Case("Conical cantilevers, w L² sqrt(rho A/EI)",
             "Kirchhoff 1879; Conway, Becker & Dubil 1964: Bessel functions", published.cones,
             "16 and 60 elements. The whole cone's are 8.719, 21.15 and 38.45.", quick=False),
        Case("Disc with static and dynamic unbalance, whirling", "Friswell et al. (2010), s. 6.2; closed form", published.whirl,
             "By `unbalance_response`. A run in time with the whole unbalance (tilt 0.017 rad) differs by 3e-4: what a linear formula "
             "leaves out, of second order in the tilt."),
    ],
    "Torsion": [
        Case("Chain of five discs", "Friswell et al. (2010), Ex. 9.7.1, as openTorsion tests it", published.chain, quick=False),
        Case("Geared branches", "Friswell et al. (2010), ch. 9, as openTorsion tests it", published.geared, quick=False),
        Case("Tuned damper, exact optimum", "Nishihara & Asami, J. Vib. Acoust. 124 (2002) 576", published.absorber,
             "Den Hartog's fixed points (1956) are 4.5826 at a mass ratio of 0.1 where the optimum is 4.5892: his is the "
             "height of the points, not of the peaks, which lie a little beside them.", quick=False),
    ],
    "Bearings, shaft defects, balancing": [
        Case("Short journal bearing, its place and eight coefficients",
             "Friswell et al. (2010), Ex. 5.5.1, as ROSS tests it (u across the load, v along it)", published.ocvirk,
             "**A disagreement.** ROSS prints attitude angles of 0.1989 and 0.1617 rad. They are the arctangent of "
             "pi sqrt(1 - e²)/4 *times* e; Ocvirk's is *over* e: 70.62 and 74.52 degrees, which the equilibrium itself confirms."),
        Case("Bearing of finite length", "Raimondi & Boyd, ASLE Trans. 1 (1958) 159, as in Shigley", published.raimondi,
             "**A disagreement, argued.** Ours bear 0 to 20 % less. Their film ends where pressure *and slope* vanish (Reynolds), ours is "
             "cut off where the pressure falls below ambient (Guembel), which bears less; against our own finite differences of "
             "Reynolds' equation with that cut the fit is within 4 %."),
        Case("Compliance of an open crack", "Papadopoulos & Dimarogonas, as tabulated in ROSS 2.3: c E R³/(1 - nu²)", published.crack,
             "Bending that opens the crack: to the table's digits. **A disagreement** lies in the other direction: ROSS's table across the "
             "crack is half of the integral over the whole of it; ours is checked by adaptive quadrature (`tests/test_shaft_defects.py`)."),
        Case("Two-plane balancing", "Rao, Mechanical Vibrations, Ex. 9.2", published.two_planes,
             "Correction weights; the book prints the unbalances, opposite to them."),
        Case("Balance grade", "ISO 21940-11", published.grade, "The standard's table is rounded: 6.3/314.159 mm is 20.05 g·mm/kg."),
    ],
    "Runs in time": [
        Case("Run-up through the critical speed at constant acceleration",
             "Lewis 1932, Baker 1939, Fearn & Millsaps 1967; exact solution by the error function", published.run_up,
             "Lewis's own graphs are summed up as 3.68 sqrt(q) for the undamped peak, q = w0²/(2 pi alpha): 1.6 % below the exact solution at "
             "alpha = 0.001 w0². The exact one is compared.", quick=False),
        Case("Captured at its critical speed, or through (Sommerfeld)",
             "EXUDYN, rigidRotor3Drunup.py; steady whirl by Kononenko 1969: T = c W r²", published.capture, quick=False),
        Case("Free asymmetric top", "Landau & Lifshitz, Mechanics, s. 37; numbers from 30-digit arithmetic", published.top, quick=False),
    ],
}  # fmt: skip

REST = """## Of other kinds

- **The paper's machine** (Matyja & Łazarz 2014): what its text reports of the start-up, and what is found: the second rotor's lateral amplitude is
  comparable with the main one's, with a fiftieth of its unbalance (1.17 and 0.69 mm, both at 385 rad/s); the main rotor centres itself past the critical
  speed (its mass centre from 0.5 to 0.22 mm off the axis), the second does not; the second's tilts are the larger (0.0100 and 0.0062 rad). Its
  Table 1 prints a diameter of 0.110 m for rotor two; mass and inertias fit 0.112 m. Section lengths stand in a figure alone: those used are
  the ones with which all of this holds ([the paper's machine](physics.md#the-papers-machine)).
- **ROSS 2.3**: natural frequencies of three of its example rotors at five speeds to 1e-6, unbalance responses to 1e-5 (`tests/test_ross.py`). What is not
  alike: mass-proportional damping does not brake the spin there; tapered elements take means of both ends in axial and torsional motion,
  integrals here, and the middle section's shear coefficient; a torque acts about the centre line there, about the sections' axis here; tables of coefficients are extrapolated there, held here.
- **CVODE, IDA, LSODA, Radau** on equations written anew: [benchmarks](benchmarks.md).
- **Torsional modulation** (Verichev et al., J. Sound Vib. 329 (2010) 13): sidebands of a whirl whose speed is modulated, by Bessel functions, to 1e-9;
  **nutation** of a free rotor (Goldstein) to 1e-10; **conservation** of energy and momenta (`tests/test_published.py`).
- **The rig** of a published data set, its run-ups and what they say of the model: [vectors and balancing](balancing.md).
"""


def page() -> str:
    lines = [
        "# Validation",
        "",
        "Every published case that the tests hold the program to: what is printed, what the program gives, by what part they differ, and the "
        "source. Written by `docs/pages/validation.py`, with machines and numbers of the tests; disagreements are argued below the tables. "
        "Numbers printed by another program are told as such.",
        "",
    ]
    for group, cases in CASES.items():
        lines += [f"## {group}", ""]
        for case in cases:
            lines += [f"### {case.title}", "", f"*Source:* {case.source}.", ""]
            lines += ["| quantity | printed | ours | difference |", "|---|---|---|---|"]
            lines += ["| " + " | ".join(row) + " |" for row in case.table()]
            lines += [""] + ([case.argued, ""] if case.argued else [])
    return "\n".join(lines) + "\n" + REST


def written() -> dict[str, list[list[str]]]:
    """case -> the rows of its table as they stand on the page."""
    found: dict[str, list[list[str]]] = {}
    title = ""
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("### "):
            title = line[4:]
        elif line.startswith("| ") and not line.startswith("| quantity"):
            found.setdefault(title, []).append(
                [cell.strip() for cell in line.strip("| ").split(" | ")]
            )
    return found


def stale(case: Case, rows: list[list[str]]) -> list[str]:
    """Rows of the page that the program no longer gives: by more than the last digit that is printed."""
    now = case.table()
    if [list(row[:2]) for row in now] != [row[:2] for row in rows]:
        return [f"{case.title}: other rows"]
    return [
        f"{case.title}: {row[0]} is {row[2]} now, not {old[2]}"
        for row, old in zip(now, rows)
        if np.any(np.abs(_numbers(row[2]) - _numbers(old[2])) > 1.01 * _last_digit(row[1]))
    ]


def _numbers(cell: str) -> np.ndarray:
    return np.array(re.findall(r"-?\d[\d.]*(?:e[-+]\d+)?", cell), float)


def _last_digit(printed: str) -> float:
    digits = re.findall(r"\d[\d.]*(?:e[-+]\d+)?", printed)
    return min((10.0 ** int(Decimal(one).as_tuple().exponent) for one in digits), default=0.0)


def main() -> int:
    if "--write" in sys.argv[1:]:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    rows = written()
    quick = [case for cases in CASES.values() for case in cases if case.quick]
    wrong = [words for case in quick for words in stale(case, rows.get(case.title, []))]
    print("\n".join(wrong) or f"{len(quick)} quick cases are as the page says")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
