"""What an assessment holds: findings, and what moves each."""

from dataclasses import dataclass, field
from typing import Any

from ..machine.machine import Machine
from ..standards.finding import Assessment, Finding
from ..standards.moves import Moves, Term
from ..standards.separation import SeparationCheck
from ..standards.stability import (
    StabilityChart,
)
from ..standards.unbalance_cases import UnbalanceCase


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


def direct(machine: Machine, at: Any, function: Any) -> Moves:
    return (Term(1.0, machine, at, function),)
