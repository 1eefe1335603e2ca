"""What `jaxrotor run` leaves in its folder: figures and a summary."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import plot
from ..core.files import written_whole
from ..core.protocol import AbstractConnector
from ..core.result_text import table_of
from ..machine.machine import Machine
from ..plot import select
from ..plot.style import close, figure_of
from ..simulation.export import versions
from ..simulation.response import Response
from ..study.diagnosis import Diagnosis
from .diagnostic_figures import diagnosis

# Below this a third of the run is too short for a spectrum.
_SPECTRUM_SAMPLES = 128


def figures(response: Response, study: Any = None) -> dict[str, Callable[[], Any]]:
    """name -> what draws it, for all that this machine has something to show of, and for what the
    study asks for. Its `report` says which station comes first, and which figures are wanted."""
    machine = response.machine
    report = getattr(study, "report", None)
    rotors = select.rotors(machine)
    if report is not None and report.main is not None:
        rotors = [report.main, *(n for n in rotors if n != report.main)]
    rotors = rotors[:3]
    drive = select.drive(machine)
    bearings = select.with_signal(machine, "bearing_force")
    shafts = select.with_signal(machine, "torque", AbstractConnector)
    plans: list[tuple[str, str, Callable[[], Any]]] = [
        ("machine", "machine", lambda: plot.draw_machine(machine)),
        ("spin", f"spin_{rotors[0]}", lambda: plot.spin(response, rotors[0])),
    ]
    # a line that only turns has no paths to draw
    swaying = [name for name in rotors if machine.sways(name)]
    if swaying:
        plans += [
            (
                "trajectories",
                "trajectories_geometric_centres",
                lambda: plot.trajectories(response, swaying),
            ),
            (
                "trajectories",
                "trajectories_mass_centres",
                lambda: plot.trajectories(response, swaying, "mass"),
            ),
            ("distances", "distances_over_speed", lambda: plot.distances(response, swaying)),
        ]
    for name in swaying:
        for kind, draw in (("vibration", plot.vibration), ("inclinations", plot.inclinations)):
            plans.append(
                (kind, f"{kind}_{name}", lambda name=name, draw=draw: draw(response, name))
            )
    if drive is not None:
        plans.append(
            (
                "differences",
                "speed_differences",
                lambda: plot.speed_differences(response, rotors, drive),
            )
        )
        if len(response.t) >= _SPECTRUM_SAMPLES:
            plans.append(
                ("spectrum", "spectrum", lambda: plot.speed_spectrum(response, rotors, drive))
            )
    if bearings:
        plans.append(
            ("bearing_forces", "bearing_forces", lambda: plot.bearing_forces(response, bearings))
        )
    if shafts:
        plans.append(("torques", "torques", lambda: plot.torques(response, shafts, drive)))
    if report is not None and report.figures is not None:
        plans = [plan for plan in plans if plan[0] in report.figures]
    found = {
        f"{i:02d}_{name.replace(' ', '_')}": draw
        for i, (_, name, draw) in enumerate(plans, start=1)
    }
    for wanted in getattr(study, "figures", ()):
        draw = diagnosis if isinstance(wanted, Diagnosis) else _chart
        found[wanted.stem] = lambda wanted=wanted, draw=draw: draw(response, wanted)
    return found


def _chart(response: Response, wanted: Any) -> Any:
    """A figure that a study asks for."""
    return plot.over_time(response, wanted.y, wanted.x, wanted.units, wanted.title)


def write_report(
    study: Any,
    response: Response,
    folder: Path,
    extra: dict[str, Any] | None = None,
    draw: bool = True,
) -> list[Path]:
    """Draws every figure as PNG and writes `summary.json` into `folder`; returns their paths.

    `study` (or `None`) gives title, source, and which figures to draw; `extra` is added to the
    summary; `draw=False` leaves the figures out. Each file is written whole or not at all.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, drawn in figures(response, study).items() if draw else ():
        fig = figure_of(drawn())
        with written_whole(folder / f"{name}.png") as part:
            fig.savefig(part, dpi=150, format="png")
        close([fig])
        written.append(folder / f"{name}.png")
    content = {
        "title": getattr(study, "title", None),
        "source": getattr(study, "source", None),
        "versions": versions(),
        "run": response.stats,
        **summary(response),
        **(extra or {}),
    }
    with written_whole(folder / "summary.json") as part:
        part.write_text(json.dumps(content, indent=2, default=_plain) + "\n")
    return [*written, folder / "summary.json"]


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") and np.size(value) == 1 else str(value)


def _peak(t: np.ndarray, speed: np.ndarray, values: np.ndarray) -> dict[str, float]:
    k = int(np.argmax(np.abs(values)))
    return {"peak": float(np.abs(values[k])), "time_s": float(t[k]), "speed_rad_s": float(speed[k])}


def summary(response: Response) -> dict[str, Any]:
    """Peaks of every part, with the time (s) and speed (rad/s) at which they occur; SI."""
    machine: Machine = response.machine
    t = np.asarray(response.t)
    stations, connectors = {}, {}
    for name in machine.wiring.stations:
        part = response[name]
        q, speed = np.asarray(part.position), np.asarray(part.speed)
        found = {
            "radial_displacement_m": _peak(t, speed, np.hypot(q[:, 0], q[:, 1])),
            "axial_displacement_m": _peak(t, speed, q[:, 2]),
            "tilt_rad": _peak(t, speed, np.hypot(q[:, 3], q[:, 4])),
            "final_speed_rad_s": float(speed[-1]),
        }
        if "bearing_force" in part.signals():
            found["bearing_force_N"] = _peak(
                t, speed, np.linalg.norm(np.asarray(part.bearing_force), axis=1)
            )
        reaction = np.asarray(part.reaction)
        if np.any(reaction):
            found["reaction_torque_Nm"] = _peak(t, speed, reaction[:, 5])
            found["power_W"] = _peak(t, speed, np.asarray(part.power))
        stations[name] = found
    drive = select.drive(machine) or machine.wiring.stations[0]
    speed = np.asarray(response[drive].speed)
    for name in response.lineup.wiring.connectors:  # those inside composites too
        part = response[name]
        if "torque" in part.signals():
            connectors[name] = {"torque_Nm": _peak(t, speed, np.asarray(part.torque))}
    return {
        "duration_s": float(t[-1]),
        "samples": len(t),
        "stations": stations,
        "connectors": connectors,
    }


def summary_table(response: Response) -> str:
    """Peaks of every station, for the terminal."""
    rows = [("station", "radial peak", "at speed", "at time", "tilt", "bearing force")]
    for name, found in summary(response)["stations"].items():
        radial, force = found["radial_displacement_m"], found.get("bearing_force_N")
        moved = radial["peak"] > 0
        rows.append(
            (
                name,
                f"{1e3 * radial['peak']:.4g} mm",
                f"{radial['speed_rad_s']:.4g} rad/s" if moved else "-",
                f"{radial['time_s']:.4g} s" if moved else "-",
                f"{1e3 * found['tilt_rad']['peak']:.3g} mrad",
                f"{force['peak']:.4g} N" if force else "-",
            )
        )
    return table_of(rows)
