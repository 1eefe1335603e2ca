"""What a study's [standards] and [torsional] say of its machine: every finding, and what moves it."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..core.errors import InputError
from ..machine.axial import axial_positions
from ..machine.machine import Machine
from ..simulation.summary import parts_with_mass
from ..standards.balance_grade import residual_unbalance
from ..standards.finding import Assessment, Finding
from ..standards.moves import (
    SIZES,
    Moves,
    Numbers,
    Term,
    Whirl,
    of_decrement,
    of_factor,
    of_torsion,
    scaled,
)
from ..standards.placed import own_unbalance, placed_response
from ..standards.sensitivity_zones import loop_sensitivity
from ..standards.separation import SeparationCheck, required_margins, separation_margins
from ..standards.stability import (
    StabilityChart,
    left_out,
    level_two,
    rigid_critical_speed,
    stability_chart,
)
from ..standards.torsional import excitation_bands, torsional_separation
from ..standards.unbalance_cases import UnbalanceCase, at_clearances, unbalance_cases
from ..standards.unbalance_check import checked_response
from ..standards.vibration_zones import housing_vibration, shaft_vibration
from .standards import Balance, Loop, Stability, Standards, Vibration
from .torsional import Torsional
from .torsional_checks import excitations_of, lives


@dataclass(frozen=True)
class Item:
    """A finding, and what moves its `room` (its value, where there is no limit). `decides`: whether the
    machine is rejected where it is not met; level 1 asks for level 2 instead, where that is looked at."""

    finding: Finding
    moves: Moves = ()
    decides: bool = True


@dataclass
class Assessed:
    """Findings in the order of the field, and what figures are drawn from. `separations`: name of the
    unbalance and machine -> check."""

    items: list[Item] = field(default_factory=list)
    cases: tuple[UnbalanceCase, ...] = ()
    separations: dict[str, SeparationCheck] = field(default_factory=dict)
    unbalances: dict[str, Any] = field(default_factory=dict)
    chart: StabilityChart | None = None
    torsional_speeds: tuple[float, float] | None = None

    @property
    def assessment(self) -> Assessment:
        return Assessment(tuple(item.finding for item in self.items))


def assessed(
    machine: Machine, asked: Standards | None, torsional: Torsional | None, moving: bool = True
) -> Assessed:
    """`moving`: whether what moves each number is found too. Raises `InputError` as the checks do."""
    out = Assessed()
    if asked is not None:
        if asked.probes:
            _lateral(out, machine, asked, moving)
        if asked.stability is not None:
            out.items += _stability(out, machine, asked, asked.stability, moving)
        for one in asked.magnetic:
            out.items.append(_loop(machine, one, asked))
        if asked.balance is not None:
            out.items += _balance(machine, asked.balance, moving)
        for one in asked.vibration:
            out.items.append(_vibration(machine, one, asked, moving))
    if torsional is not None:
        out.items += _torsion(out, machine, asked, torsional, moving)
    if not out.items:
        raise InputError(
            "`standards`: names nothing to assess: write probes, [standards.stability], [standards.balance], "
            "[[standards.vibration]] or [[standards.magnetic]]"
        )
    return out


def _lateral(out: Assessed, machine: Machine, asked: Standards, moving: bool) -> None:
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
    words = ", ".join(x for x in (finding.place, name) if x)
    return Finding(
        finding.check,
        words,
        finding.value,
        finding.limit,
        finding.sense,
        finding.unit,
        finding.source,
    )


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
                    moves += _direct(
                        machine,
                        asked.state,
                        lambda m, n=name: 2 * asked.limits.share * m[n].clearance,
                    )
        yield Item(finding, moves)


def _direct(machine: Machine, at: Any, function: Any) -> Moves:
    return (Term(1.0, machine, at, function),)


def _stability(
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


def _loop(machine: Machine, one: Loop, asked: Standards) -> Item:
    words: dict[str, Any] = dict(signal=one.signal, acts_on=one.acts_on, against=one.against)
    words = {key: value for key, value in words.items() if value is not None}

    def found(m: Machine) -> Finding:
        (finding,) = loop_sensitivity(
            m, one.name, one.speed, one.limits, one.accepted, at=asked.state, **words
        ).findings
        return finding

    return Item(found(machine), _direct(machine, asked.state, lambda m: found(m).room))


def _balance(machine: Machine, one: Balance, moving: bool) -> Iterator[Item]:
    def found(m: Machine) -> tuple[Finding, ...]:
        return _residuals(m, one)

    for k, finding in enumerate(found(machine)):
        sizes = Numbers(lambda m, k=k: float(found(m)[k].room), SIZES)
        yield Item(finding, (Term(1.0, machine, "undeformed", sizes),) if moving else ())


def _residuals(machine: Machine, one: Balance) -> tuple[Finding, ...]:
    places = axial_positions(machine)
    masses = [p for p in parts_with_mass(machine) if p.mass]
    mass = sum(p.mass for p in masses)
    planes = centre = None
    if one.planes is not None:
        planes = [places[s] for s in one.planes]
        centre = sum(p.mass * p.position for p in masses) / mass
    amounts: Any = one.residual
    if amounts is None:
        own = own_unbalance(machine)
        each = np.asarray(own.amounts) * np.exp(1j * np.asarray(own.angles))
        amounts = [abs(each.sum())]
        if planes is not None:
            second = (np.array([places[s] for s in own.stations]) - planes[0]) / (
                planes[1] - planes[0]
            )
            amounts = [abs(np.sum(each * (1 - second))), abs(np.sum(each * second))]
    found = residual_unbalance(amounts, mass, one.speed, one.grade, planes=planes, centre=centre)
    names = ("",) if one.planes is None else tuple(f"at {name}" for name in one.planes)
    return tuple(replace_place(finding, name) for finding, name in zip(found.findings, names))


def replace_place(finding: Finding, place: str) -> Finding:
    return Finding(
        finding.check,
        place,
        finding.value,
        finding.limit,
        finding.sense,
        finding.unit,
        finding.source,
    )


def _vibration(machine: Machine, one: Vibration, asked: Standards, moving: bool) -> Item:
    w, shaft = asked.greatest, one.kind == "shaft"
    value, moves = one.value, ()
    if value is None:
        names = [f"{one.place}.x", f"{one.place}.y"] if shaft else [one.place]
        seen = placed_response(machine, asked.unbalance, names, [w], at=asked.state)
        sizes = np.abs(np.asarray(seen.values))[0]
        k = int(np.argmax(sizes))
        value = float(sizes[k]) * (2.0 if shaft else w / np.sqrt(2))
        if moving:
            whirl = Whirl(machine, asked.unbalance, [names[k]], [w], asked.state)
            moves = scaled(whirl.of_level(w, whirl.seen[0]), -value)
    if shaft:
        found = shaft_vibration(value, w, one.accepted, place=one.place)
        if one.limits is not None:
            (finding,) = found.findings
            limit = jnp.asarray(one.limits["ABC".index(one.accepted)])
            found = Assessment(
                (
                    Finding(
                        finding.check,
                        one.place,
                        finding.value,
                        limit,
                        "at most",
                        "m",
                        "limits as given",
                    ),
                )
            )
    else:
        found = housing_vibration(
            value, one.group, one.support, one.accepted, one.limits, place=one.place
        )
    return Item(found.findings[0], moves)


def _torsion(
    out: Assessed, machine: Machine, asked: Standards | None, torsional: Torsional, moving: bool
) -> Iterator[Item]:
    speeds = torsional.speeds or (None if asked is None else asked.speeds)
    if speeds is None:
        raise InputError(
            '`torsional`: speeds are missing: write speeds = ["1450 rpm", "1500 rpm"] to assess it'
        )
    out.torsional_speeds = speeds
    torsional = replace(torsional, speeds=speeds)
    excitations = excitations_of(machine, torsional, speeds)
    found = torsional_separation(
        machine, speeds, excitations, margin=torsional.margin, count=torsional.modes
    )
    natural = of_torsion(machine, 0.5 * sum(speeds), "undeformed") if moving else []
    bands = np.asarray(excitation_bands(machine, excitations, speeds))
    for k, finding in enumerate(found.findings):
        moves: Moves = ()
        if moving and len(bands):
            w, of_w = natural[k]
            each = np.maximum(1 - w / bands[:, 0], w / bands[:, 1] - 1)
            e = int(np.argmin(each))
            low, high = bands[e]
            below = 1 - w / low > w / high - 1
            moves = scaled(of_w, -1 / low if below else 1 / high)
            one = excitations[e]
            if one.shaft is not None and not one.frequency > 0 and of_w:
                weight = w / low**2 if below else -w / high**2
                moves += scaled(
                    _direct(
                        machine, "undeformed",
                        lambda m, one=one, side=int(not below): excitation_bands(m, (one,), speeds)[0, side],
                    ),
                    weight,
                )  # fmt: skip
        yield Item(finding, moves)
    for finding, room in lives(machine, torsional, len(found.findings), speeds):
        of = (Term(1.0, machine, "undeformed", Numbers(room, None)),)
        yield Item(finding, of if moving and np.isfinite(float(finding.value)) else ())
