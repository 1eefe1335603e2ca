"""What [standards] says of balance and of vibration in service."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..machine.axial import axial_positions
from ..machine.machine import Machine
from ..simulation.summary import parts_with_mass
from ..standards.balance_grade import residual_unbalance
from ..standards.finding import Assessment, Finding
from ..standards.moves import (
    SIZES,
    Numbers,
    Term,
    Whirl,
    scaled,
)
from ..standards.placed import own_unbalance, placed_response
from ..standards.vibration_zones import housing_vibration, shaft_vibration
from .assessed import Item
from .standards import Balance, Standards, Vibration


def balance(machine: Machine, one: Balance, moving: bool) -> Iterator[Item]:
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
    return tuple(replace(finding, place=name) for finding, name in zip(found.findings, names))


def vibration(machine: Machine, one: Vibration, asked: Standards, moving: bool) -> Item:
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
