"""What [standards] says of the response to unbalance: margins, vibration, clearances."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import jax
import numpy as np

from ..core.errors import InputError
from ..machine.machine import Machine
from ..standards.finding import Assessment, Finding
from ..standards.moves import (
    Moves,
    Whirl,
    of_factor,
    scaled,
)
from ..standards.separation import SeparationCheck, required_margins, separation_margins
from ..standards.unbalance_cases import at_clearances, unbalance_cases
from ..standards.unbalance_check import checked_response
from .assessed import Assessed, Item, direct
from .standards import Standards


def lateral(out: Assessed, machine: Machine, asked: Standards, moving: bool) -> None:
    least, greatest = asked.speeds
    machines = {"": machine}
    if asked.films:
        machines = at_clearances(machine, asked.films)
    if asked.unbalance is None:
        out.cases = unbalance_cases(machine, greatest, asked.bearings, asked.modes)
        if not out.cases:
            raise InputError(
                "`standards`: no critical speed below three times the greatest, by whose shape to place "
                'unbalance: write unbalance = { station = "100 g*mm" }'
            )
        out.unbalances = {f"for {case.name}": case.unbalance for case in out.cases}
    else:
        out.unbalances = {"": asked.unbalance}
    limits = asked.limits
    keep: dict[str, Any] = dict(
        most_below=limits.most_below, most_above=limits.most_above, least_factor=limits.least_factor
    )
    for unbalance_name, unbalance in out.unbalances.items():
        for machine_name, one in machines.items():
            name = ", ".join(x for x in (machine_name, unbalance_name) if x)
            check = separation_margins(
                one, list(asked.probes), least, greatest, unbalance, at=asked.state, **keep
            )
            out.separations[name] = check
            speeds = np.array([0.05 * least, 2 * greatest])
            whirl = Whirl(one, unbalance, asked.probes, speeds, asked.state) if moving else None
            out.items += _separation(check, whirl, name, asked)
            found, places = checked_response(
                {name: one}, list(asked.probes), least, greatest, unbalance, asked.clearances,
                trip=asked.trip, limit=limits.probe, share=limits.share, most=limits.scale,
                count=None, points=201, at=asked.state,
            )  # fmt: skip
            out.items += _response(found, places, whirl, one, asked)


def _told(finding: Finding, name: str) -> Finding:
    return replace(finding, place=", ".join(x for x in (finding.place, name) if x))


def _separation(
    check: SeparationCheck, whirl: Whirl | None, name: str, asked: Standards
) -> Iterator[Item]:
    findings = iter(check.assessment.findings)
    least, greatest = asked.speeds
    limits = asked.limits.most_below, asked.limits.most_above, asked.limits.least_factor
    for i, one in enumerate(check.resonances):
        for k, w in enumerate(np.asarray(one.speeds)):
            factor, margin = next(findings), next(findings)
            of_af: Moves = ()
            of_margin: Moves = ()
            if whirl is not None:
                moves = whirl.of_peak(one, k, whirl.seen[i])
                of_af = of_factor(one, k, moves)
                below = (least - w) / least > (w - greatest) / greatest
                of_margin = scaled(moves["speed"], -100 / least if below else 100 / greatest)
                if of_af and margin.sense != "for information":
                    asks = jax.grad(
                        lambda a, side=int(not below): required_margins(a, *limits)[side]
                    )
                    of_margin += scaled(of_af, -float(asks(factor.value)))
            yield Item(_told(factor, name), of_af)
            yield Item(_told(margin, name), of_margin)


def _response(
    found: Assessment, places: Any, whirl: Whirl | None, machine: Machine, asked: Standards
) -> Iterator[Item]:
    worst, *others = places
    amplitude, scale, *gaps = found.findings
    if whirl is None:
        yield from (Item(finding) for finding in found.findings)
        return
    seen = whirl.seen[list(asked.probes).index(worst.probe)]
    top = whirl.of_level(float(worst.speed), seen)
    yield Item(amplitude, scaled(top, -float(amplitude.value)))
    free = float(scale.value) < asked.limits.scale
    yield Item(scale, scaled(top, -float(scale.value)) if free else ())
    if not gaps:
        return
    stations = [one.probe for one in others]
    ends = np.array([0.02, 1.0]) * max(asked.trip or 0.0, asked.greatest)
    inside = Whirl(machine, whirl.unbalance, stations, ends, asked.state)
    for finding, one, look in zip(gaps, others, inside.seen):
        moves = inside.of_level(float(one.speed), look) + (scaled(top, -1.0) if free else ())
        moves = scaled(moves, -float(finding.value))
        for name, element in machine.elements().items():
            own = getattr(element, "clearance", None)
            here = machine.connections().get(name, ("",))[0].partition(".")[0] == one.probe
            if own is not None and here and one.probe not in asked.clearances:
                if np.isclose(2 * float(own), float(one.gap)):
                    moves += direct(
                        machine,
                        asked.state,
                        lambda m, n=name: 2 * asked.limits.share * m[n].clearance,
                    )
        yield Item(finding, moves)
