"""What `jaxrotor modes` and `jaxrotor campbell` do: linear analysis of a study's machine."""

import csv
import json
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import folder_written_whole, written_whole
from ..units import read
from .study import Study

RPM = 30 / np.pi


def speed_of(text: str | None, option: str) -> float | None:
    """An option such as "3000 rpm", rad/s."""
    if text is None:
        return None
    try:
        return float(read(text, "rad/s"))
    except ValueError as error:
        raise InputError(f"`{option}`: {error}") from None


def run_modes(study: Study, speed: str | None, count: int) -> int:
    """Prints the lowest modes of the machine at a speed, in its deflected state."""
    from ..linear.linearise import linearize
    from ..linear.modes import modes, table

    at = speed_of(speed, "--speed") or 0.0
    found = modes(linearize(study.machine, at), _positive(count, "--count"))
    print(f"{study.title or study.name}: modes at {at * RPM:.6g} rpm ({at:.6g} rad/s)")
    print(table(found) if found else "nothing oscillates at this speed")
    return 0


def run_campbell(
    study: Study, top: str | None, points: int, count: int, out: Path | None, force: bool
) -> int:
    """Writes campbell.png, campbell.csv and summary.json; prints the critical speeds."""
    from ..linear.campbell import campbell
    from ..linear.critical import critical_speeds
    from ..plot.linear import campbell_diagram
    from ..solve.plan import top_speed

    machine = study.machine
    reach = speed_of(top, "--to")
    if reach is None:
        reach = 1.2 * top_speed(machine, study.settings.t_end, study.settings.speed)[1]
    if not reach > 0:
        raise InputError(
            "`--to`: the highest speed must be positive, and this machine's drive gives none: write "
            '--to "6000 rpm"'
        )
    if points < 2:
        raise InputError(f"`--points`: must be two at least, but is {points}")
    found = campbell(machine, np.linspace(0.0, reach, points), _positive(count, "--modes"))
    critical = np.asarray(critical_speeds(machine))
    critical = critical[critical <= reach]
    folder = out if out is not None else Path("results") / f"{study.name}_campbell"
    with folder_written_whole(folder, force) as part:
        figure = campbell_diagram(found)
        with written_whole(part / "campbell.png") as file:
            figure.savefig(file, dpi=150, format="png")
        with written_whole(part / "campbell.csv") as file, open(file, "w", newline="") as lines:
            writer = csv.writer(lines)
            writer.writerow(
                ["speed, rad/s"]
                + [f"{n}, {q}" for n in found.names for q in ("rad/s", "damping ratio", "whirl")]
            )
            for i, speed in enumerate(found.speeds):
                row = [
                    x[i, k]
                    for k in range(len(found.names))
                    for x in (found.frequencies, found.damping_ratios, found.whirl)
                ]
                writer.writerow([f"{v:.10g}" for v in (speed, *row)])
        summary = {
            "study": str(study.path) if study.path is not None else study.name,
            "speeds_rad_s": [0.0, reach, points],
            "modes": list(found.names),
            "critical_speeds_rad_s": critical.tolist(),
            "critical_speeds_are": "undamped, the frequency equal to the speed, machine undeformed",
        }
        with written_whole(part / "summary.json") as file:
            file.write_text(json.dumps(summary, indent=2) + "\n")
    listed = ", ".join(f"{w * RPM:.6g}" for w in critical) or "none"
    print(f"critical speeds up to {reach * RPM:.6g} rpm (undamped): {listed} rpm")
    print(f"{folder}/: campbell.csv, campbell.png, summary.json")
    return 0


def _positive(count: int, option: str) -> int:
    if count < 1:
        raise InputError(f"`{option}`: must be one at least, but is {count}")
    return count
