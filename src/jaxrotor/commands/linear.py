"""What `jaxrotor modes` and `jaxrotor campbell` do: linear analysis of a study's machine."""

from pathlib import Path

import numpy as np

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.files import folder_written_whole, save_json
from ..study.study import Study
from .made import made_of
from .options import RPM, positive, quantity_of, reach_of, study_name
from .output import save_figure, save_table


def run_modes(
    study: Study, speed: str | None, count: int, out: Path | None = None, force: bool = False
) -> int:
    """Prints the lowest modes of the machine at a speed, in its deflected state; into `out` also their
    shapes, as figures and numbers."""
    from ..linear.linearise import linearize
    from ..linear.modes import modes, table

    at = quantity_of(speed, "rad/s", "--speed") or 0.0
    model = linearize(study.machine, at)
    found = modes(model, positive(count, "--count"))
    print(f"{study.title or study.name}: modes at {at * RPM:.6g} rpm ({at:.6g} rad/s)")
    print(table(found) if found else "nothing oscillates at this speed")
    if out is None or not found:
        return 0
    from ..plot.shapes import mode_shapes

    with folder_written_whole(out, force) as part:
        for view in ("2d", "3d"):
            figure = mode_shapes(study.machine, model, range(1, len(found) + 1), view)
            save_figure(figure, part / f"modes_{view}.png")
        header = ["station.coordinate", *(f"{m.name}, {q}" for m in found for q in ("re", "im"))]
        rows = [
            [f"{s}.{c}", *(f"{x:.10g}" for m in found for x in (m.shape[i].real, m.shape[i].imag))]
            for i, (s, c) in enumerate(model.coordinates)
        ]
        save_table(part / "modes.csv", header, rows)
        summary = {
            "study": study_name(study),
            "made": made_of(study),
            "speed_rad_s": at,
            "modes": [
                {
                    "name": m.name,
                    "frequency_rad_s": m.frequency,
                    "damping_ratio": m.damping_ratio,
                    "log_decrement": m.log_decrement,
                    "whirl": m.whirl,
                    "energy": m.shares,
                }
                for m in found
            ],
        }
        save_json(part / "summary.json", summary)
    print(f"{out}/: modes.csv, modes_2d.png, modes_3d.png, summary.json")
    return 0


def run_campbell(
    study: Study,
    top: str | None,
    points: int,
    count: int,
    orders: tuple[float, ...],
    out: Path | None,
    force: bool,
) -> int:
    """Writes campbell.png, campbell.csv and summary.json; prints the critical speeds."""
    from ..linear.campbell import campbell
    from ..linear.critical import critical_modes
    from ..plot.linear import campbell_diagram

    machine = study.machine
    reach = reach_of(study, top)
    whole(2, 1_000_000)(points, "`--points`:")
    if not orders or not all(order > 0 for order in orders):
        raise InputError("`--orders`: must be positive numbers, such as --orders 1,2")
    speeds = np.linspace(0.0, reach, points)
    found = campbell(machine, speeds, positive(count, "--modes"), progress=True)
    at_speed = {order: critical_modes(machine, order, speeds=(0.0, reach)) for order in orders}
    critical = {order: [m.frequency / order for m in each] for order, each in at_speed.items()}
    folder = out if out is not None else Path("results") / f"{study.name}_campbell"
    with folder_written_whole(folder, force) as part:
        save_figure(campbell_diagram(found, orders, at_speed), part / "campbell.png")
        header = ["speed, rad/s"]
        header += [f"{n}, {q}" for n in found.names for q in ("rad/s", "damping ratio", "whirl")]
        columns = np.stack([found.frequencies, found.damping_ratios, found.whirl], axis=-1)
        rows = np.concatenate([found.speeds[:, None], columns.reshape(points, -1)], axis=1)
        save_table(part / "campbell.csv", header, [[f"{v:.10g}" for v in row] for row in rows])
        summary = {
            "study": study_name(study),
            "made": made_of(study),
            "speeds_rad_s": [0.0, reach, points],
            "modes": list(found.names),
            "critical_speeds_rad_s": {f"{order:g}x": w for order, w in critical.items()},
            "critical_modes": {f"{o:g}x": [m.name for m in each] for o, each in at_speed.items()},
            "critical_kinds": {f"{o:g}x": [m.kind for m in each] for o, each in at_speed.items()},
            "critical_speeds_are": "undamped, the frequency so many times the speed, machine undeformed",
        }
        save_json(part / "summary.json", summary)
    for order, each in at_speed.items():
        times = "" if order == 1 else f" of order {order:g}"
        print(
            f"critical speeds{times} up to {reach * RPM:.6g} rpm (undamped):{'' if each else ' none'}"
        )
        for mode in each:
            unmoved = "" if mode.kind == "lateral" else "  (unbalance does not excite it)"
            print(f"  {mode.frequency / order * RPM:10.6g} rpm  {mode.name}{unmoved}")
    print(f"{folder}/: campbell.csv, campbell.png, summary.json")
    return 0
