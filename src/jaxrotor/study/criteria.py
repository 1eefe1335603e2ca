"""What a study minimises and bounds: [[optimize.objective]] and [[optimize.constraints]]."""

import operator
from pathlib import Path
from typing import Any

from ..core.units import shown
from ..machine.machine import Machine
from ..objectives.criterion import Constraint, Criterion
from ..objectives.measure import AbstractMeasure
from ..optimization.experiment import NoRun, SimulatedRun
from ..simulation.simulation import Simulation
from .build import FAILED
from .kinds import public_kinds
from .measures import MEASURES, build_measure, unit_seen
from .mistakes import Faults
from .unknowns import read_quantity

_LIMITS = {"at_most": operator.le, "at_least": operator.ge, "equal_to": Criterion.equal_to}
_OVER = ("worst", "mean")


class CriteriaReader:
    """All measures of a run look at the same `run`, all of the machine itself at the same `built`, so each is
    made once."""

    def __init__(
        self,
        machine: Machine,
        settings: Simulation,
        variations: Any,
        folder: Path,
        faults: Faults,
    ):
        self.machine, self.settings, self.folder, self.faults = machine, settings, folder, faults
        self.varied = variations is not None
        self.run = SimulatedRun(settings, variations=variations)
        self.built = NoRun(variations)

    def objective(self, tables: Any) -> Criterion | None:
        parts = []
        for place, table in self._tables(tables, "objective"):
            self.faults.unknown_keys(place, table, ("measure", "weight", "over"))
            criterion, _ = self._criterion(table, place)
            weight = read_quantity(table.get("weight", 1.0), "", f"{place}: weight", self.faults)
            if criterion is not None:
                parts.append(weight * criterion if weight != 1 else criterion)
        return sum(parts[1:], parts[0]) if parts else None

    def constraints(self, tables: Any) -> tuple[Constraint, ...]:
        found = []
        for place, table in self._tables(tables, "constraints"):
            self.faults.unknown_keys(place, table, ("measure", "over", *_LIMITS))
            criterion, unit = self._criterion(table, place)
            given = [key for key in _LIMITS if key in table]
            if len(given) != 1:
                what = " and ".join(given) + " are" if given else "none is"
                self.faults.add(
                    place, f"needs one of at_most, at_least and equal_to, but {what} given"
                )
            elif criterion is not None:
                limit = read_quantity(table[given[0]], unit, f"{place}: {given[0]}", self.faults)
                found.append(_LIMITS[given[0]](criterion, limit))
        return tuple(found)

    def _tables(self, tables: Any, key: str) -> list[tuple[str, dict]]:
        if not isinstance(tables, list):
            self.faults.add(
                "optimize",
                f"{key} must be a list, but is {shown(tables)}: write [[optimize.{key}]]",
            )
            return []
        found = []
        for i, table in enumerate(tables):
            place = f"optimize.{key}, entry {i + 1}"
            if isinstance(table, dict):
                found.append((place, table))
            else:
                self.faults.add(
                    place, f"must be a table, but is {shown(table)}: give it measure = {{ ... }}"
                )
        return found

    def _criterion(self, table: dict, place: str) -> tuple[Criterion | None, str]:
        """And its unit."""
        over = table.get("over", "worst")
        if over not in _OVER:
            self.faults.add(place, f'over must be "worst" or "mean", but is {shown(over)}')
            over = "worst"
        elif "over" in table and not self.varied:
            self.faults.add(
                place,
                "over goes with [optimize.variations], which is not there: remove it, or add that",
            )
        measure = self._measure(table.get("measure"), place)
        if measure is FAILED:
            return None, ""
        unit = unit_seen(measure, place, self.machine, self.settings, self.faults)
        if unit is None:
            return None, ""
        if isinstance(measure, AbstractMeasure):
            return self.run.measure(measure, over), unit
        return self.built.measure(measure, over), unit

    def _measure(self, table: Any, place: str) -> Any:
        if not isinstance(table, dict) or "kind" not in table:
            listed = ", ".join(public_kinds(MEASURES))
            given = "is missing" if table is None else f"must be a table, but is {shown(table)}"
            given = "has no kind" if isinstance(table, dict) else given
            self.faults.add(
                place, f'measure {given}: write measure = {{ kind = "...", ... }}, one of {listed}'
            )
            return FAILED
        return build_measure(
            table, place, self.machine, self.folder, self.faults, prefix="measure."
        )
