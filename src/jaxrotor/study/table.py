"""A run as a table: time and named quantities."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.files import written_whole
from ..core.kinematics import COORDINATES
from ..machine.wiring import unknown
from .quantities import quantities, read_quantity, split


def save_csv(
    response: Any, path: str | os.PathLike[str], names: str | Sequence[str] | None
) -> Path:
    """A line of names, a line of units, a line for each sample with all digits; written whole or not at all.
    Raises `InputError` for a batch and for what the machine has not."""
    if response.t.ndim != 1:
        raise InputError(
            "this is a batch of responses: write one of them, `response.member(i).to_csv(...)`"
        )
    wanted = wanted_quantities(response, names)
    columns, units = [], []
    for name in ("t", *wanted):
        values, unit = read_quantity(response, name)
        columns.append(values.tolist())
        units.append(unit or "1")
    with written_whole(Path(path)) as part, open(part, "w", newline="", encoding="utf-8") as lines:
        csv.writer(lines).writerows([("t", *wanted), units, *zip(*columns)])
    return Path(path)


def wanted_quantities(response: Any, names: str | Sequence[str] | None) -> list[str]:
    """All of them known, each once."""
    known = quantities(response.machine)
    if names is None:
        own = [*COORDINATES, "speed"]
        stations = response.machine.wiring.stations[: len(response.machine.stations)]
        found = [f"{station}.{quantity}" for station in stations for quantity in own]
        for name in response.machine.wiring.order:  # of shafts with mass the elements are too many
            part = response[name] if name in known else None
            found += [f"{name}.{signal}" for signal in (part.signals() if part else ())]
        return found
    found = [names] if isinstance(names, str) else list(names)
    faults = []
    for k, name in enumerate(found):
        part, quantity = split(name)
        if part not in known:
            faults.append(f'`{name}`: {unknown("part", part, known)}: write it as "part.quantity"')
        elif quantity not in known[part]:
            faults.append(f"`{name}`: {unknown('quantity', quantity, known[part])}")
        elif name in found[:k]:
            faults.append(f"`{name}`: is named twice: leave one of them out")
    if faults:
        raise InputError(*faults)
    return found
