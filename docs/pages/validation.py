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
sys.path.insert(1, str(ROOT / "tests"))

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxrotor as jr  # noqa: E402

PAGE = ROOT / "docs" / "validation.md"
RPM = np.pi / 30


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


def nearest(found: Any, wanted: Any) -> np.ndarray:
    found = np.asarray(found)
    return np.array([found[np.argmin(np.abs(found - w))] for w in wanted])


def two_disc_rotor():
    from test_shafts_with_mass import FRISWELL, two_disc

    rows = []
    for rpm, printed in FRISWELL.items():
        model = jr.linearize(two_disc(), rpm * RPM, at="undeformed")
        for one, ours in zip(printed, nearest(model.damped_frequencies, printed)):
            rows.append((f"at {rpm} rpm, rad/s", one, ours))
    return rows


def overhung_rotor():
    from test_linear import ROOTS, overhung

    rows = []
    for rpm, left, right, printed in ROOTS:
        model = jr.linearize(overhung(left, right), rpm * RPM, at="undeformed")
        for one, ours in zip(printed, nearest(model.eigenvalues, printed)):
            rows.append((f"bearings {left} and {right}, {rpm} rpm, 1/s", complex(one), complex(ours)))
    printed = ["358.43", "389.35", "2123.79", "2659.1", "3118.14"]
    found = nearest(jr.critical_speeds(overhung(5, 5)) / RPM, np.array(printed, float))
    return rows + [("critical speed, bearings 5, rpm", p, o) for p, o in zip(printed, found)]


def stodola_green():
    from test_linear import GREEN, stodola

    rows = []
    for speed, printed in GREEN.items():
        model = jr.linearize(stodola(), float(speed), at="undeformed")
        for one, ours in zip(printed, nearest(model.damped_frequencies, printed)):
            rows.append((f"at {speed} rad/s, rad/s", one, ours))
    critical = [356.4814121898121, 490.5469505610065, 1346.9901203123886]
    found = nearest(jr.critical_speeds(stodola()), critical)
    return rows + [("critical speed, rad/s", p, o) for p, o in zip(critical, found)]


def onset():
    from test_linear import jeffcott

    return [("onset, rad/s", "300.0", jr.stability_threshold(jeffcott(4.0, 2.0), 100.0, 500.0))]


def chain():
    from test_gears import TURNING_ONLY, torsion, turning

    parts: dict[str, Any] = {}
    for i, inertia in enumerate([0.0035, 0.0035, 0.0035, 0.15, 0.05]):
        parts[f"disc {i}"] = turning(inertia)
        if i < 4:
            parts[f"shaft {i}"] = torsion([12000.0, 12000.0, 14000.0, 10000.0][i])
    machine = jr.Machine.in_line(parts, fixed={f"disc {i}": TURNING_ONLY for i in range(5)})
    return _hertz(machine, ["81.21", "141.21", "378.95", "536.36"])


def geared():
    from test_gears import geared as machine

    return _hertz(machine(), ["425.4", "634.1", "3247.2"])


def _hertz(machine: jr.Machine, printed: list[str]):
    model = jr.linearize(machine, at="undeformed")
    found = nearest(np.asarray(model.damped_frequencies) / (2 * np.pi), np.array(printed, float))
    return [("Hz", p, o) for p, o in zip(printed, found)]


def beams():
    import test_shafts_with_mass as t

    rows = []
    for words, fixed, printed in (("free", None, t.FREE_FREE), ("pinned", t.PINNED, t.SUPPORTED)):
        machine = t.bar(jr.FiniteElementShaft, 16, fixed=fixed, **t.BERNOULLI)
        model = jr.linearize(machine, at="undeformed")
        found = nearest(np.asarray(model.damped_frequencies) / 2 / np.pi, printed)
        rows += [(f"bending, {words} ends, Hz", p, o) for p, o in zip(printed, found)]
    model = jr.linearize(t.bar(jr.FiniteElementShaft, 20, fixed=t.CLAMPED), at="undeformed")
    for words, printed in (("torsion", t.TORSION), ("axial", t.AXIAL)):
        found = nearest(model.damped_frequencies, printed) / 2 / np.pi
        rows += [(f"{words}, fixed and free, Hz", p / 2 / np.pi, o) for p, o in zip(printed, found)]
    return rows


def ocvirk():
    from test_bearings import BEARING, WEIGHT

    rows = []
    for rpm, ratio, attitude in ((1500, "0.266298", "70.62004779"), (2000, "0.212571", "74.51812994")):
        x, y = np.asarray(BEARING.working_point((0.0, -WEIGHT), rpm * RPM).eccentricity)
        rows.append((f"eccentricity ratio, {rpm} rpm", ratio, np.hypot(x, y) / 1e-4))
        rows.append((f"attitude angle, {rpm} rpm, degrees", attitude, np.degrees(np.arctan2(x, -y))))
    point = BEARING.working_point((0.0, -WEIGHT), 1500 * RPM)
    printed = ["12.80796", "16.393593", "-25.060393", "8.815303"]
    K = np.asarray(point.stiffness).ravel() / 1e6
    rows += [(f"k_{ij}, MN/m", p, o) for ij, p, o in zip(("uu", "uv", "vu", "vv"), printed, K)]
    printed = ["232.89693", "-81.924371", "-81.924371", "294.911619"]
    C = np.asarray(point.damping).ravel() / 1e3
    return rows + [(f"c_{ij}, kN·s/m", p, o) for ij, p, o in zip(("uu", "uv", "vu", "vv"), printed, C)]


def raimondi():
    printed = {
        0.25: {0.2: "7.57", 0.6: "1.07", 0.8: "0.261"},
        0.5: {0.2: "2.03", 0.6: "0.319", 0.8: "0.0923"},
        1.0: {0.2: "0.631", 0.6: "0.121", 0.8: "0.0446"},
    }
    rows = []
    for slenderness, row in printed.items():
        for eps, one in row.items():
            bearing = jr.JournalBearing(0.1, 0.1 * slenderness, 1e-4, 0.1, theory="finite")
            f = bearing.force(jnp.array([eps * 1e-4, 0.0]), jnp.array([0.0, -50.0 * eps * 1e-4]))
            pressure = np.hypot(*np.asarray(f)) / (0.1 * 0.1 * slenderness)
            ours = (0.05 / 1e-4) ** 2 * 0.1 * (100 / (2 * np.pi)) / pressure
            rows.append((f"Sommerfeld number, L/D {slenderness}, ratio {eps}", one, ours))
    return rows


def crack():
    from jaxrotor.elements.shafts.crack_compliance import crack_compliance

    printed = {0.1: "0.0277722", 0.2: "0.144614", 0.4: "0.72488", 0.6: "1.8922", 0.8: "3.97355", 1.0: "7.79039"}
    return [
        (f"depth {a} of the radius", p, crack_compliance(jnp.asarray(a / 2), 2.0, 1.0, 0.0)[0])
        for a, p in printed.items()
    ]


def absorber():
    from test_norms import PUBLISHED, TURN, WN, K, machine

    rows = []
    for mu, (f, zeta, height) in PUBLISHED.items():
        peaks = jr.linear.response_peaks(machine(mu, f, zeta), TURN, TURN, 0.0, 2 * WN, at="undeformed")
        for which, ours in zip(("lower", "upper"), np.asarray(peaks.magnitudes) * K):
            rows.append((f"{which} peak, mass ratio {mu}", height, ours))
    return rows


def two_planes():
    phasor = jr.identification.phasor
    before, trials = phasor([8.5, 6.5], [60, 205]), phasor([10.0, 12.0], [270, 180])
    after = [phasor([6.0, 4.5], [125, 230]), phasor([6.0, 10.5], [35, 160])]
    coefficients = jr.identification.influence_coefficients(before, trials, after)
    found = np.asarray(jr.balance(before, coefficients).corrections)
    angles = np.rad2deg(np.angle(found)) % 360
    printed = [("10.0561", "325.5548"), ("5.8774", "68.2559")]
    return [
        row
        for plane, (size, angle), c, a in zip(("left", "right"), printed, found, angles)
        for row in ((f"{plane}, weight", size, abs(c)), (f"{plane}, degrees", angle, a))
    ]


def grade():
    permitted = jr.Unbalance.from_grade(6.3, 3000 * RPM).eccentricity
    return [("G 6.3 at 3000 rpm, g·mm/kg", "20", float(permitted) * 1e6)]


def whirl():
    from test_published import WHIRL, whirling

    rows = []
    for speed, (radius, tilt) in WHIRL.items():
        machine = whirling(1e-4, float(speed))  # of a ten-thousandth of the unbalance: linear
        response = jr.unbalance_response(machine, ["disc.x", "disc.psi"], [float(speed)], at="undeformed")
        found = np.abs(np.asarray(response.values)[0]) / 1e-4
        rows.append((f"radius at {speed} rad/s, m", abs(radius), found[0]))
        rows.append((f"tilt at {speed} rad/s, rad", abs(tilt), found[1]))
    return rows


def run_up():
    from test_published import RUN_UP, jeffcott

    rows = []
    for alpha, zeta, t_peak, peak in RUN_UP:
        t_end, count = 1.1 * t_peak, 4096
        machine = jeffcott(jr.LinearRamp(alpha * 1.2 * t_peak, 1.2 * t_peak), 2 * zeta)
        plan = jr.Plan(2, 6, 0.0, 0.0, 0.0, 0.0)
        response = jr.simulate(machine, t_end, count / t_end, "undeformed", step=plan)
        size = np.asarray(response["disc"].x) ** 2 + np.asarray(response["disc"].y) ** 2
        i = int(np.argmax(size))
        near = slice(i - 6, i + 7)
        shape = np.polynomial.Polynomial.fit(np.asarray(response.t)[near], size[near], 12)
        roots = shape.deriv().roots()
        t = min(roots[np.abs(roots.imag) < 1e-9].real, key=lambda r: abs(r - response.t[i]))
        words = f"acceleration {alpha} w0², damping ratio {zeta}"
        rows.append((f"{words}: peak, e", f"{peak:.10g}", np.sqrt(shape(t))))
        rows.append((f"{words}: at, 1/w0", f"{t_peak:.10g}", t))
    return rows


def top():
    import test_published as t

    machine = jr.Machine({"top": jr.RigidBody(1.0, np.array([1.0, 2.0, 3.0]))}, {})
    start = jr.State(np.zeros((1, 6)), np.array([[0, 0, 0, 1.0, 0, 1.0]]))
    import diffrax

    run = jr.simulate(machine, 10.0, 10.0, start, solver=diffrax.Dopri8(), step=0.01)["top"]
    w, _ = t.body_rates(run.position, run.velocity)
    rows = []
    for instant, (angles, rates) in t.TOP.items():
        for name, p, o in zip(("psi", "theta"), angles, np.asarray(run.position)[10 * instant, 3:5]):
            rows.append((f"{name} at {instant} s, rad", f"{p:.10g}", o))
        for name, p, o in zip("xyz", rates, w[10 * instant]):
            rows.append((f"w_{name} at {instant} s, rad/s", f"{p:.10g}", o))
    return rows


def capture():
    import test_sommerfeld as t

    speed, radius = t.run(0.1)
    fast, _ = t.run(0.2)
    return [
        ("0.1 N·m", "captured", "captured" if speed[200] < t.CRITICAL else "passes"),
        ("0.2 N·m", "passes", "passes" if fast[200] > 2 * t.CRITICAL else "captured"),
        ("captured at, rad/s", t.SPEED, speed[-1]),
        ("with the radius, m", t.AMPLITUDE, radius[-1]),
    ]


CASES = {
    "Rotors, linear": [
        Case("Two-disc rotor on isotropic bearings",
             "Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), Ex. 5.9.1, as ROSS prints it",
             two_disc_rotor,
             "The same Timoshenko elements, so every digit is asked. 650.40786626 rad/s is the shaft's first free torsional mode.",
             quick=False),
        Case("Overhung rotor, nine pairs of bearings, and its critical speeds",
             "Friswell et al. (2010), Ex. 6.8.1 and 6.9.1, Tables 6.3 and 6.4", overhung_rotor,
             "To half of the last printed digit. Real parts are printed to three decimals: where they are near zero their own "
             "difference is all rounding.", quick=False),
        Case("Overhung disc on a shaft without mass", "Stodola 1927, Green 1948; closed form", stodola_green),
        Case("Onset of instability by rotating damping", "Genta; Vance: w0 (1 + external/internal)", onset, quick=False, argued=
             "The paper's own beta = 0.002 s, read as damping that turns with the shaft, would make its machine unstable soon above its "
             "critical speed; read in the fixed frame, as here by default, it does not ([shaft section](physics.md#shaft-section))."),
        Case("Beams and bars", "Genta 2008, p. 286; Rao: closed forms", beams,
             "The meshes' own errors, no more: (beta h)⁴/1440 of 16 cubic elements in bending, (beta h)²/24 of 20 linear ones in "
             "torsion and tension. The second bending mode of eight cubic elements would miss 1e-4 by this law, whoever wrote them.", quick=False),
        Case("Disc with static and dynamic unbalance, whirling", "Friswell et al. (2010), s. 6.2; closed form", whirl,
             "By `unbalance_response`. A run in time with the whole unbalance (tilt 0.017 rad) differs by 3e-4: what a linear formula "
             "leaves out, of second order in the tilt."),
    ],
    "Torsion": [
        Case("Chain of five discs", "Friswell et al. (2010), Ex. 9.7.1, as openTorsion tests it", chain, quick=False),
        Case("Geared branches", "Friswell et al. (2010), ch. 9, as openTorsion tests it", geared, quick=False),
        Case("Tuned damper, exact optimum", "Nishihara & Asami, J. Vib. Acoust. 124 (2002) 576", absorber,
             "Den Hartog's fixed points (1956) are 4.5826 at a mass ratio of 0.1 where the optimum is 4.5892: his is the "
             "height of the points, not of the peaks, which lie a little beside them.", quick=False),
    ],
    "Bearings, shaft defects, balancing": [
        Case("Short journal bearing, its place and eight coefficients",
             "Friswell et al. (2010), Ex. 5.5.1, as ROSS tests it (u across the load, v along it)", ocvirk,
             "**A disagreement.** ROSS prints attitude angles of 0.1989 and 0.1617 rad. They are the arctangent of "
             "pi sqrt(1 - e²)/4 *times* e; Ocvirk's is *over* e: 70.62 and 74.52 degrees, which the equilibrium itself confirms."),
        Case("Bearing of finite length", "Raimondi & Boyd, ASLE Trans. 1 (1958) 159, as in Shigley", raimondi,
             "**A disagreement, argued.** Ours bear 0 to 20 % less. Their film ends where pressure *and slope* vanish (Reynolds), ours is "
             "cut off where the pressure falls below ambient (Guembel), which bears less; against our own finite differences of "
             "Reynolds' equation with that cut the fit is within 4 %."),
        Case("Compliance of an open crack", "Papadopoulos & Dimarogonas, as tabulated in ROSS 2.3: c E R³/(1 - nu²)", crack,
             "Bending that opens the crack: to the table's digits. **A disagreement** lies in the other direction: ROSS's table across the "
             "crack is half of the integral over the whole of it; ours is checked by adaptive quadrature (`tests/test_shaft_defects.py`)."),
        Case("Two-plane balancing", "Rao, Mechanical Vibrations, Ex. 9.2", two_planes,
             "Correction weights; the book prints the unbalances, opposite to them."),
        Case("Balance grade", "ISO 21940-11", grade, "The standard's table is rounded: 6.3/314.159 mm is 20.05 g·mm/kg."),
    ],
    "Runs in time": [
        Case("Run-up through the critical speed at constant acceleration",
             "Lewis 1932, Baker 1939, Fearn & Millsaps 1967; exact solution by the error function", run_up,
             "Lewis's own graphs are summed up as 3.68 sqrt(q) for the undamped peak, q = w0²/(2 pi alpha): 1.6 % below the exact solution at "
             "alpha = 0.001 w0². The exact one is compared.", quick=False),
        Case("Captured at its critical speed, or through (Sommerfeld)",
             "EXUDYN, rigidRotor3Drunup.py; steady whirl by Kononenko 1969: T = c W r²", capture, quick=False),
        Case("Free asymmetric top", "Landau & Lifshitz, Mechanics, s. 37; numbers from 30-digit arithmetic", top, quick=False),
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
  integrals here; tables of coefficients are extrapolated there, held here.
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
            found.setdefault(title, []).append([cell.strip() for cell in line.strip("| ").split(" | ")])
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
