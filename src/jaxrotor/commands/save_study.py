"""A study file with other values: what was read, changed where asked."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ..core.document import read_document
from ..core.errors import InputError
from ..core.files import written_whole
from ..machine.machine import Machine
from ..study.study import Study
from ..study.write import written


def save_study(study: Study, machine: Machine, paths: Iterable[str], target: Path) -> Path:
    """Writes the study's file with the values that `machine` has at `paths` (whole parameters, no entries of
    them). Comments are not kept. Raises `InputError` for what does not stand in the file as a number."""
    if study.path is None:
        raise InputError("the study was not read from a file: there is none to write anew")
    document = read_document(study.path, "[machine]")
    document.pop("identify", None)  # its records lie beside the file that was read
    if "table" in document.get("sweep", {}):
        document.pop("sweep")  # as its table does
    for path in paths:
        _put(document, path, machine, study)
    with written_whole(target) as part:
        part.write_text(tomli_w.dumps(document))
    return target


def _put(document: dict[str, Any], path: str, machine: Machine, study: Study) -> None:
    head, *steps = path.split(".")
    table = document["machine"] if head == "gravity" else _element(document["machine"], head)
    steps = steps or [head]
    for step in steps[:-1]:
        if isinstance(table, list) and step.isdigit():
            table = table[int(step)]
        else:
            table = table.setdefault(step, {}) if isinstance(table, dict) else None
    if not isinstance(table, dict):
        raise InputError(
            f"`{path}`: does not stand in `{study.path}` as a number: change it there by hand"
        )
    table[steps[-1]] = written(np.asarray(machine.get(path)), machine.units(path))


def _element(machine: dict[str, Any], name: str) -> Any:
    for section in ("line", "attachments"):
        for table in machine.get(section, []):
            if table.get("name") == name:
                return table
    found = machine.get("elements", {}).get(name)
    if found is None:
        raise InputError(f"`{name}`: does not stand in the study file: change it there by hand")
    return found
