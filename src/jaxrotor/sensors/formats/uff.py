"""Universal files: functions over time in data sets 58, as text or binary (58b)."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyuff

from ...core.errors import InputError
from ...core.units import factor, known_unit
from .table import Column, Table
from .uff_words import AXES, BESIDE, DATASETS, FUNCTIONS, place_of, unit_of

# Before and after each data set.
_MARK = b"    -1"
_TIME = 17  # of an axis
_COMPLEX = (5, 6)


def read_uff(file: Path) -> Table:
    """Signals are named after the entity of their response, or its node and direction (`12+X`), or the first
    line of their description. Raises `InputError` for files that hold no signal, with what they hold."""
    data = file.read_bytes()
    if _MARK not in data:
        raise InputError(
            f"`{file}`: is no universal file: it has no line with -1: is its name right?"
        )
    if not data.rstrip().endswith(_MARK):
        raise InputError(
            f"`{file}`: is cut off: its last data set has no end (a line with -1): copy or export it again"
        )
    opened = pyuff.UFF(str(file))
    kinds = [int(kind) for kind in opened.get_set_types()]
    sizes = _read(file, opened, kinds.index(164)) if 164 in kinds else {}
    heads = [_read(file, opened, k, True) for k, kind in enumerate(kinds) if kind == 58]
    names, notes = _names(heads)
    columns: dict[str, Column] = {}
    others: dict[str, str] = {}
    for name, head in zip(names, heads):
        if words := _no_signal(head):
            others[name] = words
            continue
        found = _read(file, opened, head["set"])
        count = min(head["num_pts"], len(found["data"]))
        if count < head["num_pts"]:
            notes.append(f"`{name}` has {count} values, though its header says {head['num_pts']}")
        unit = head["abscissa_axis_units_lab"]
        size = (factor(unit, "s") if known_unit(unit) else None) or 1.0
        t, values = size * found["x"][:count], found["data"][:count]
        columns[name] = Column(lambda v=values: v, unit_of(head, sizes), lambda t=t: t)
    beside = [kind for kind in dict.fromkeys(kinds) if kind != 58]
    if not columns:
        functions = [f"58 ({words})" for words in dict.fromkeys(others.values())]
        listed = ", ".join([*functions, *map(_told, beside)])
        raise InputError(
            f"`{file}`: holds no signal over time, but the data sets {listed}: export the time histories, as "
            "data sets 58"
        )
    if passed := [_told(kind) for kind in beside if kind not in BESIDE]:
        notes.append(f"data sets {', '.join(passed)} are passed over")
    return Table(columns, tuple(notes), others)


def _told(kind: int) -> str:
    return f"{kind} ({DATASETS[kind]})" if kind in DATASETS else str(kind)


def _read(file: Path, opened: Any, k: int, head: bool = False) -> dict[str, Any]:
    try:
        return {"set": k, **opened.read_sets(k, header_only=head)}
    except Exception:  # pyuff says no more than that it failed
        raise InputError(
            f"`{file}`: its data set {k + 1} cannot be read: its lines are not as the format has them: "
            "export it again, or as text instead of binary"
        ) from None


def _no_signal(head: Mapping[str, Any]) -> str:
    """What a function is that is no real one over time, or ""."""
    kind, axis = head["func_type"], head["abscissa_spec_data_type"]
    what = FUNCTIONS[kind] if 0 <= kind < len(FUNCTIONS) else f"function of type {kind}"
    if kind not in (0, 1) or axis not in (_TIME, 0, 1)[: 3 if kind else 1]:
        over = AXES.get(axis, "")
        return f"{what} over {over}" if over else what
    return f"complex {what}" if head["ord_data_type"] in _COMPLEX else ""


def _names(heads: list[dict[str, Any]]) -> tuple[list[str], list[str]]:
    """A name for each function, all different, and notes on those that were not."""
    first = [_name(head) for head in heads]
    again = Counter(first)
    notes = [f"{n} functions are named `{name}`: numbered" for name, n in again.items() if n > 1]
    seen: Counter[str] = Counter()
    out = []
    for name in first:
        seen[name] += 1
        out.append(f"{name} ({seen[name]})" if again[name] > 1 else name)
    return out, notes


def _name(head: Mapping[str, Any]) -> str:
    entity, line = head["rsp_ent_name"].strip(), head["id1"].strip()
    if entity.upper() not in ("", "NONE"):
        return entity
    if head["rsp_node"]:
        return place_of(head["rsp_node"], head["rsp_dir"])
    return line if line.upper() not in ("", "NONE") else "signal"
