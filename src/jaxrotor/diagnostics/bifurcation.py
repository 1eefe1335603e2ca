"""Bifurcation diagrams: the section of a motion over a parameter, by batched runs."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..core.arguments import number, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import TURN
from ..core.result_text import shows
from ..machine.machine import Machine
from ..machine.wiring import unknown
from ..objectives.peak import PeakValue
from ..sensors.sensor import AbstractSensor
from ..simulation.solver import is_planned, solver_for
from ..sweeps.cases import Cases, as_cases
from ..sweeps.checks import check_cases
from ..sweeps.planning import prescribed_of
from ..sweeps.sweep import sweep
from .once_per_turn import PoincareSamples
from .poincare import period_of

# Of the exponential solver, unless somebody says otherwise: errors decide to which of several motions a run
# is drawn.
_TOLERANCE = 1e-6
# Speeds of a drive that differ by this part of themselves during a run are not constant.
_CONSTANT = 1e-9


@shows(values="@path_unit", points="@unit", size="@unit", speed="rad/s")
class Bifurcation(NamedTuple):
    """A diagram.

    - `path`, `values`: (n,), the parameter and its values; `path_unit`: its unit, SI.
    - `points`: (n, keep), the quantity once a turn, in `unit`; NaN for a run that failed.
    - `size`: (n,), its largest distance from its mean over those turns.
    - `speed`: (n,), rad/s, of the drive.
    - `failure`: (n,), why a run failed; empty for those that did not.
    """

    path: str
    values: np.ndarray
    points: np.ndarray
    size: np.ndarray
    speed: np.ndarray
    failure: np.ndarray
    unit: str
    path_unit: str

    plot = plot_door()

    def period(self, tolerance: float = 1e-3, longest: int = 16) -> np.ndarray:
        """(n,): after how many turns each motion repeats, to `tolerance` of its `size`; 0 where not within
        `longest` (quasi-periodic, chaotic, not settled yet, or failed)."""
        scaled = self.points / np.where(self.size > 0, self.size, 1.0)[:, None]
        return np.array([period_of(row[None], tolerance, longest) for row in scaled])


@takes(parameters=None, drop=whole(0), keep=whole(2), phase=number("rad"), samples=whole(8))
def bifurcation(
    machine: Machine,
    parameters: Cases | Mapping[str, Any],
    quantity: AbstractSensor,
    shaft: str,
    *,
    drop: int = 200,
    keep: int = 50,
    phase: float = 0.0,
    samples: int = 40,
    initial: Any = "static",
    **options: Any,
) -> Bifurcation:
    """Runs `machine` at constant speed for each value, drops the first turns, and takes `quantity` once in
    each of those that follow.

    **Arguments:**

    - `parameters`: path -> (n,) values, SI; the first path is the diagram's axis, others go with it. A
      drive's speed such as `"motor.motion.speed"`, or any other parameter.
    - `quantity`: a sensor, such as `ProximityProbe("disc", 0.0)`.
    - `shaft`: the station whose turns count.
    - `drop`, `keep`: turns of the drive that each run goes through before, and turns that are shown.
    - `phase`: rad, of the shaft at which the section is taken.
    - `samples`: in a turn of the fastest run.
    - `initial`: as for `simulate`: all runs start alike, and each finds the motion that it is drawn to from
      there. Where several motions are stable, other starts find the others: overlay their diagrams.
    - `options`: those of `jr.sweep`: `solver`, `step`, `tolerance` (1e-6 where steps are planned), `rtol`,
      `atol`, `store`, `resume`, `chunk`, `client`, `progress` (a bar where a person looks on).

    All runs are batched by `jr.sweep`, sampled alike and as long as the slowest one needs: over a range of
    speeds of more than 1 to 3 two diagrams cost less. Raises `InputError` for a machine whose drive does not
    hold a constant speed.
    """
    cases = as_cases(parameters)
    if not isinstance(machine, Machine):
        raise InputError(f"`machine`: must be a Machine, but is {machine!r}")
    machine.check()
    if not isinstance(quantity, AbstractSensor):
        raise InputError(
            f"`quantity`: must be a sensor such as ProximityProbe('disc', 0.0), but is {quantity!r}"
        )
    if shaft not in machine.wiring.stations:
        raise InputError(f"`shaft`: {unknown('station', shaft, machine.wiring.stations)}")
    check_cases(machine, cases)
    speed = _constant_speeds(machine, cases, drop + keep + 1)
    # a turn more: marks need not fall onto the start
    seconds = (drop + keep + 1) * TURN / float(np.abs(speed).min())
    rate = samples * float(np.abs(speed).max()) / TURN
    last = seconds * keep / (drop + keep + 1)
    outputs = {
        "points": PoincareSamples(quantity, shaft, keep, phase),  # pyright: ignore[reportCallIssue]
        "size": PeakValue(quantity, about="mean", start=jnp.asarray(seconds - last)),
    }
    if is_planned(solver_for(machine, options.get("solver"))) and options.get("step") is None:
        options.setdefault("tolerance", _TOLERANCE)
    flat = Cases(cases.values, cases.how)
    found = sweep(
        machine, flat, outputs, t_end=seconds, sample_rate=rate, initial=initial, **options
    )
    points = found["points"].values
    failure = found["failure"].values
    short = np.isnan(points).any(axis=1) & (failure == "")
    if short.any():
        row = int(np.argmax(short))
        raise InputError(
            f"`shaft`: `{shaft}` makes fewer than {keep} turns in case {row + 1}: name a station that turns "
            "as fast as the drive, raise `drop`, or keep fewer"
        )
    path = next(iter(flat.values))
    return Bifurcation(
        path,
        flat.values[path],
        points,
        found["size"].values,
        speed,
        failure,
        quantity.unit,
        found[path].attrs.get("units", ""),
    )


def _constant_speeds(machine: Machine, cases: Cases, turns: int) -> np.ndarray:
    """(n,), rad/s, of the drive, which keeps it for so many turns."""
    if not machine.is_driven:
        raise InputError(
            "`machine`: must have a drive that holds its speed, but nothing prescribes its spin: prescribe "
            "phi of a station by ConstantSpeed"
        )
    begin = np.abs(prescribed_of(machine, cases.values, np.zeros(1)).speeds)
    slowest = float(begin[begin > 0].min(initial=np.inf))
    until = turns * TURN / slowest if np.isfinite(slowest) else 1.0
    speeds = np.asarray(prescribed_of(machine, cases.values, np.linspace(0.0, until, 64)).speeds)
    fastest = np.abs(speeds).max(axis=1)
    uneven = np.ptp(speeds, axis=1) > _CONSTANT * fastest
    if uneven.any():
        row = int(np.argmax(uneven))
        raise InputError(
            f"`machine`: must turn at constant speed, but in case {row + 1} its drive goes from "
            f"{speeds[row].min():.6g} to {speeds[row].max():.6g} rad/s: drive it by ConstantSpeed"
        )
    still = ~(fastest > 0) | ~np.isfinite(fastest)
    if still.any():
        row = int(np.argmax(still))
        raise InputError(
            f"`parameters`: every case must turn, but the drive of case {row + 1} has {speeds[row, 0]:g} "
            "rad/s: leave it out"
        )
    return speeds[:, 0]
