"""What [standards] says of stability: levels 1 and 2, and control loops."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..linear.loops import AXES
from ..machine.machine import Machine
from ..standards.finding import Finding
from ..standards.moves import (
    Moves,
    of_decrement,
    of_sensitivity,
    scaled,
)
from ..standards.sensitivity_zones import axes_of, loop_sensitivity, peak_sensitivity
from ..standards.stability import (
    left_out,
    level_two,
    rigid_critical_speed,
    stability_chart,
)
from .assessed import Assessed, Item, direct
from .standards import Loop, Stability, Standards


def stability(
    out: Assessed, machine: Machine, asked: Standards, wanted: Stability, moving: bool
) -> Iterator[Item]:
    speed, at = asked.greatest, asked.state
    ratio = None
    if wanted.density is not None:
        bearings = _supports(machine, asked)
        ratio = speed / rigid_critical_speed(machine, bearings)
    seals: dict[str, Any] = {"without": wanted.without} if wanted.without else {}
    chart = stability_chart(
        machine, wanted.stations, speed, wanted.anticipated, density=wanted.density, ratio=ratio,
        turbine=wanted.turbine, least_ratio=wanted.least_ratio,
        least_decrement=wanted.least_decrement, screened_ratio=wanted.screened_ratio, at=at, **seals,
    )  # fmt: skip
    out.chart = chart
    first = left_out(machine, wanted.without)
    whole = sum(wanted.stations.values())
    shares = {station: share / whole for station, share in wanted.stations.items()}
    for finding in chart.level_one.findings:
        moves: Moves = ()
        if moving and "Q0" in finding.check and 0 < float(chart.limit) < np.inf:
            limit = float(chart.limit)
            moves, by = of_decrement(first, speed, at, limit, shares)
            moves = scaled(moves, -1 / by / wanted.anticipated) if by else ()
        elif moving and "decrement" in finding.check:
            moves, _ = of_decrement(first, speed, at, wanted.anticipated, shares)
        yield Item(finding, moves, decides=not wanted.level_two)
    if wanted.level_two:
        (finding,) = level_two(
            machine, speed, least_decrement=wanted.least_decrement, at=at
        ).findings
        moves = of_decrement(machine, speed, at, 0.0, shares)[0] if moving else ()
        yield Item(finding, moves)


def _supports(machine: Machine, asked: Standards) -> tuple[str, ...] | None:
    """Of `bearings`, where they are supports."""
    if asked.bearings is None:
        return None
    found = []
    for name in asked.bearings:
        at = [n for n, ends in machine.connections().items() if ends[0].partition(".")[0] == name]
        found += [name] if name in machine.connections() else at[:1]
    return tuple(found)


def loop(machine: Machine, one: Loop, asked: Standards, moving: bool) -> Item:
    words: dict[str, Any] = dict(signal=one.signal, acts_on=one.acts_on, against=one.against)
    words = {key: value for key, value in words.items() if value is not None}

    def found(m: Machine) -> Finding:
        (finding,) = loop_sensitivity(
            m, one.name, one.speed, one.limits, one.accepted, at=asked.state, **words
        ).findings
        return finding

    axes = axes_of(machine, one.name)
    if axes is None:
        return Item(found(machine), direct(machine, asked.state, lambda m: found(m).room))
    every = [f"{axes[0]}.{AXES[k]}" for k in axes[1]]
    peaks = [peak_sensitivity(machine, axis, one.speed, at=asked.state) for axis in every]
    worst = int(np.argmax([float(peak.value) for peak in peaks]))
    moves: Moves = ()
    if moving and np.isfinite(peaks[worst].frequency):
        where = float(peaks[worst].frequency)
        moves = of_sensitivity(machine, every[worst], one.speed, asked.state, where)
    return Item(found(machine), scaled(moves, -1.0))
