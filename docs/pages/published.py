"""Published cases as the program gives them: for docs/pages/validation.py, rows of (quantity, printed, ours).

Machines and printed numbers are those that the tests compare, from the tests' own files.
"""

import sys
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

import jaxrotor as jr

sys.path.insert(1, str(Path(__file__).parents[2] / "tests"))
RPM = np.pi / 30


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
            rows.append(
                (f"bearings {left} and {right}, {rpm} rpm, 1/s", complex(one), complex(ours))
            )
    printed = ["358.43", "389.35", "2123.79", "2659.1", "3118.14"]
    found = nearest(jr.critical_speeds(overhung(5, 5)) / RPM, np.array(printed, float))
    return rows + [("critical speed, bearings 5, rpm", p, o) for p, o in zip(printed, found)]


def synchronous_machines():
    from test_synchronous_machine import KRAUSE, krause, rated

    rows = []
    for name, (*_, printed) in KRAUSE.items():
        machine, motion = rated(name)
        field = machine.excitation.level / krause(name).excitation.level
        angle = np.degrees(machine.load_angle(0.0, motion, machine.initial()))
        rows.append((f"{name}: field over no-load field", printed[0], float(field)))
        rows.append((f"{name}: load angle, deg", printed[1], float(angle)))
    kundur = jr.elements.SynchronousMachine.from_standard(
        555e6, 24e3, 60.0, 1.81, 1.76, 0.3, 0.23, 0.25, 8.0, 0.03, 0.07, 0.15, 0.003, 0.65, 1.0
    )
    turn, ohm = 2 * np.pi * 60, 24e3**2 / 555e6
    printed = [("L_fd", 0.165), ("L_1d", 0.1713), ("L_1q", 0.7252), ("L_2q", 0.125)]
    found = [kundur.field_leakage, kundur.d_damper_leakage, *kundur.q_damper_leakages]
    for (words, one), ours in zip(printed, found):
        rows.append((f"555 MVA: {words}, per unit", one, float(ours * turn / ohm)))
    printed = [("R_1d", 0.0284), ("R_1q", 0.00619), ("R_2q", 0.02368)]
    found = [kundur.d_damper_resistance, *kundur.q_damper_resistances]
    for (words, one), ours in zip(printed, found):
        rows.append((f"555 MVA: {words}, per unit", one, float(ours / ohm)))
    return rows


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
    for rpm, ratio, attitude in (
        (1500, "0.266298", "70.62004779"),
        (2000, "0.212571", "74.51812994"),
    ):
        x, y = np.asarray(BEARING.working_point((0.0, -WEIGHT), rpm * RPM).eccentricity)
        rows.append((f"eccentricity ratio, {rpm} rpm", ratio, np.hypot(x, y) / 1e-4))
        rows.append(
            (f"attitude angle, {rpm} rpm, degrees", attitude, np.degrees(np.arctan2(x, -y)))
        )
    point = BEARING.working_point((0.0, -WEIGHT), 1500 * RPM)
    printed = ["12.80796", "16.393593", "-25.060393", "8.815303"]
    K = np.asarray(point.stiffness).ravel() / 1e6
    rows += [(f"k_{ij}, MN/m", p, o) for ij, p, o in zip(("uu", "uv", "vu", "vv"), printed, K)]
    printed = ["232.89693", "-81.924371", "-81.924371", "294.911619"]
    C = np.asarray(point.damping).ravel() / 1e3
    return rows + [
        (f"c_{ij}, kN·s/m", p, o) for ij, p, o in zip(("uu", "uv", "vu", "vv"), printed, C)
    ]


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

    printed = {
        0.1: "0.0277722",
        0.2: "0.144614",
        0.4: "0.72488",
        0.6: "1.8922",
        0.8: "3.97355",
        1.0: "7.79039",
    }
    return [
        (f"depth {a} of the radius", p, crack_compliance(jnp.asarray(a / 2), 2.0, 1.0, 0.0)[0])
        for a, p in printed.items()
    ]


def absorber():
    from test_norms import PUBLISHED, TURN, WN, K, machine

    rows = []
    for mu, (f, zeta, height) in PUBLISHED.items():
        peaks = jr.linear.response_peaks(
            machine(mu, f, zeta), TURN, TURN, 0.0, 2 * WN, at="undeformed"
        )
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
        response = jr.unbalance_response(
            machine, ["disc.x", "disc.psi"], [float(speed)], at="undeformed"
        )
        found = np.abs(np.asarray(response.values)[0]) / 1e-4
        rows.append((f"radius at {speed} rad/s, m", abs(radius), found[0]))
        rows.append((f"tilt at {speed} rad/s, rad", abs(tilt), found[1]))
    return rows


def loads():
    import test_shaft_loads as t

    unit = t.E * t.MOMENT / t.L
    pinned = 2 * t.brentq(lambda a: np.tan(a) + a / 3, 1.6, 3.1)
    axial, thrust = dict(torque=1.0, torque_kind="axial"), dict(axial_force=-1.0)
    return [
        ("pinned, thrust (Euler), pi² EI/L²", 1.0, t.critical(elements=16, **thrust) / t.EULER),
        (
            "pinned, axial torque (Greenhill), EI/L",
            2 * np.pi,
            t.critical(elements=16, **axial) / unit,
        ),
        (
            "pinned, semi-tangential torque, EI/L",
            pinned,
            t.critical(elements=16, torque=1.0) / unit,
        ),
        (
            "cantilever, semi-tangential torque (Beck), EI/L",
            np.pi,
            t.critical(t.CLAMPED, 16, torque=1.0) / unit,
        ),
    ]


def cones():
    import test_shaft_sections as t

    rows = []
    for ratio, elements in ((0.5, 16), (1e-3, 60)):
        ours = t.lowest(t.cone(0.05, 0.05 * ratio, elements=elements), 3) / t.unit(0.05)
        for k, (exact, found) in enumerate(zip(t.exact_cone(ratio, 3), ours)):
            rows.append((f"diameters 1 to {ratio:g}, mode {k + 1}", exact, found))
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
        for name, p, o in zip(
            ("psi", "theta"), angles, np.asarray(run.position)[10 * instant, 3:5]
        ):
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
