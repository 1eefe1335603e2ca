"""What `jaxrotor response` does: the response to unbalance over speed, or to a harmonic force."""

import dataclasses
import warnings
from pathlib import Path

import numpy as np

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.files import folder_written_whole, save_json
from ..study.study import Study
from .made import made_of
from .options import RPM, names_of, quantity_of, reach_of, study_name
from .output import save_figure, save_table
from .peaks import sampled


def run_response(
    study: Study,
    outputs: str | None,
    top: str | None,
    points: int,
    force_at: str | None,
    speed: str | None,
    out: Path | None,
    force: bool,
) -> int:
    """The response to unbalance over speed, or with `force_at` to a harmonic force over frequency: at
    `points` evenly spread, and more of them at the peaks."""
    import jax.numpy as jnp

    from ..linear.critical import critical_modes
    from ..linear.orders import unbalance_response
    from ..linear.response import FrequencyResponse, frequency_response
    from ..plot.response import bode, polar

    machine = study.machine
    whole(2, 1_000_000)(points, "`--points`:")
    names = names_of(outputs) if outputs else _watched(study)
    reach = reach_of(study, top)
    grid = np.linspace(0.0, reach, points + 1)[1:]
    if force_at is None:
        if speed is not None:
            raise InputError(
                "`--speed`: goes with --at; the response to unbalance is over all speeds"
            )
        # those that unbalance excites
        found = critical_modes(machine, speeds=(0.0, reach))
        critical = np.array([m.frequency for m in found if m.kind == "lateral"])
    else:
        forces, turning = names_of(force_at), quantity_of(speed, "rad/s", "--speed") or 0.0
        critical = np.zeros(0)

    def respond(along: np.ndarray) -> FrequencyResponse:
        if force_at is None:
            return unbalance_response(machine, names, along)
        return frequency_response(machine, forces, names, along, turning)

    first: list[FrequencyResponse] = []

    def evaluate(along: np.ndarray) -> np.ndarray:
        first.append(respond(along))
        return np.asarray(first[-1].values).reshape(len(along), -1)

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*has no bound")  # said below, for each output
        along, values, settled = sampled(evaluate, grid)
    finite = np.all(np.isfinite(values), axis=1)
    along, values = along[finite], values[finite]
    shape = (len(along), *first[0].values.shape[1:])
    found = dataclasses.replace(
        first[0], frequencies=jnp.asarray(along), values=jnp.asarray(values.reshape(shape))
    )
    if not np.abs(values).max() > 0:
        raise InputError(
            f"{', '.join(names)}: nothing moves there: the machine has no unbalance (give a Rotor one), or "
            "take other --outputs"
        )
    folder = out if out is not None else Path("results") / f"{study.name}_response"
    with folder_written_whole(folder, force) as part:
        save_figure(bode(found, critical.tolist() or None), part / "bode.png")
        save_figure(polar(found), part / "polar.png")
        lines = [
            f"{o} per {i}" if found.inputs else o for o in names for i in found.inputs or ("",)
        ]
        units = [u for u in found.units for _ in found.inputs or ("",)]
        header = ["speed, rad/s" if force_at is None else "frequency, rad/s"]
        for line, unit in zip(lines, units):
            header += [f"{line}, {unit}", f"{line}, phase, rad"]
        rows = [
            [f"{x:.10g}" for x in (w, *np.stack([np.abs(v), np.angle(v)], axis=1).ravel())]
            for w, v in zip(along, values)
        ]
        save_table(part / "response.csv", header, rows)
        at = np.abs(values).argmax(axis=0)
        peaks = {
            line: {
                "amplitude": float(np.abs(values[i, k])),
                "unit": unit,
                "at_rad_s": float(along[i]),
                "bounded": bool(settled[k]),
            }
            for k, (line, unit, i) in enumerate(zip(lines, units, at))
        }
        summary = {
            "study": study_name(study),
            "made": made_of(study),
            "excitation": "unbalance of the machine" if force_at is None else found.inputs,
            "points": len(along),
            "peaks": peaks,
            "critical_speeds_rad_s": critical.tolist(),
        }
        save_json(part / "summary.json", summary)
    for line, peak in peaks.items():
        rate = (
            f"{peak['at_rad_s'] * RPM:.6g} rpm"
            if force_at is None
            else f"{peak['at_rad_s']:.6g} rad/s"
        )
        if peak["bounded"]:
            print(f"{line}: {peak['amplitude']:.4g} {peak['unit']} at most, at {rate}")
        else:
            print(f"{line}: without bound at {rate}, for nothing damps it there")
    print(f"{folder}/: bode.png, polar.png, response.csv, summary.json")
    return 0


def _watched(study: Study) -> tuple[str, ...]:
    """x and y of the rotors, the first three at most, that are free to move so."""
    from ..elements.rotors.rotor import Rotor
    from ..linear.coordinates import coordinate_order

    labels = coordinate_order(study.machine)[3]
    rotors = [n for n, e in study.machine.elements().items() if isinstance(e, Rotor)][:3]
    names = tuple(f"{n}.{c}" for n in rotors for c in "xy" if (n, c) in labels)
    if not names:
        raise InputError(
            '`--outputs`: no rotor moves sideways here: name what to watch, "shaft.torque"'
        )
    return names
