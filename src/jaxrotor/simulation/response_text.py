"""A run as text: what ran, when, how it was made, how far it can be trusted. Nothing is computed for it that
would have to be compiled."""

import textwrap
from typing import Any

import numpy as np

from ..core.protocol import AbstractConnector
from ..core.readable import amount, known_numbers
from ..core.result_text import WIDTH, cut, listed
from .attitude import poles_passed
from .response import ConnectorResponse, Response, StationResponse
from .run_info import error_words

_LABEL = 12


def response_text(response: Response) -> str:
    t = known_numbers(response.t)
    lines = [f"Response: {_times(response, t)}"]
    lines += [_line(name, listed(parts, WIDTH - _LABEL - 2)) for name, parts in _parts(response)]
    lines += [_line(name, text) for name, text in _how(response)]
    if t is not None and t.ndim == 1 and t.size and known_numbers(response.y) is not None:
        for sentence in _doubts(response):
            lines += textwrap.wrap(f"! {sentence}", WIDTH, subsequent_indent="  ")
    return "\n".join(lines)


def _line(name: str, text: str) -> str:
    return cut(f"  {name:{_LABEL - 2}}  {text}")


def _times(response: Response, t: np.ndarray | None) -> str:
    *batch, count = np.shape(response.t) or (1,)
    words = f"a batch of {' x '.join(map(str, batch))} runs, each " if batch else ""
    words += f"{count} sample{'s' * (count != 1)}"
    if t is None or not t.ndim or not count:
        return words
    at: np.ndarray = t.reshape(-1, t.shape[-1])[0]
    rate = f" at {amount(1.0 / (at[1] - at[0]), 'Hz')}" if at.size > 1 else ""
    first_and_last = amount(at[[0, -1]], "s").replace(", ", " to ")
    return f"{words}{rate}, {first_and_last.replace('[', '').replace(']', '')}"


def _parts(response: Response) -> list[tuple[str, list[str]]]:
    machine = response.machine
    stations = list(machine.wiring.stations[: len(machine.stations)])
    names = list(zip(machine.wiring.connectors, machine.connectors))
    between = [name for name, part in names if isinstance(part, AbstractConnector)]
    attached = [name for name, part in names if not isinstance(part, AbstractConnector)]
    groups = [("stations", stations), ("between", between), ("attached", attached)]
    return [(title, found) for title, found in groups if found]


def _how(response: Response) -> list[tuple[str, str]]:
    info, found = response.info, []
    if info.initial:
        found.append(("start", info.initial))
    solver = info.solver + (f", order {info.order}" if info.order is not None else "")
    if info.substeps is not None:
        solver += f", {info.substeps} step{'s' * (info.substeps != 1)} a sample"
    if info.step is not None:
        solver += f", a step of {_number(info.step, 's')}"
    found.append(("solver", solver))
    work = [f"{_number(info.steps)} steps"] * (info.steps is not None)
    work += [f"{_number(info.seconds, 's')} of computing"] * (info.seconds is not None)
    if work:
        found.append(("work", ", ".join(work)))
    errors = [
        ("", info.error, " of a coordinate's peak (its own estimate)"),
        ("pilot ", info.pilot_error, ""),
        ("asked for ", info.tolerance, ""),
    ]
    told = [f"{a}{_number(x)}{b}" for a, x, b in errors if x is not None and not _is_nan(x)]
    if told:
        found.append(("error", ", ".join(told)))
    speeds = _speeds(response)
    if speeds:
        found.append(("speeds", speeds))
    return found


def _number(x: Any, unit: str = "") -> str:
    """One number, or what all members of a batch have in common; else from where to where."""
    value = known_numbers(x)
    if value is None:
        return amount(x, unit)
    if value.size and np.all(value == value.flat[0]):
        value = np.asarray(value.flat[0])
    return amount(value, unit, 4 if unit else 2)


def _is_nan(x: Any) -> bool:
    value = known_numbers(x)
    return value is not None and bool(np.all(np.isnan(value)))


def _speeds(response: Response) -> str:
    """Of each station where the samples have been evaluated; else what was planned for."""
    motion = vars(response).get("motion")
    if motion is None or known_numbers(motion[0]) is None or np.ndim(motion[0]) != 3:
        top = response.info.planned_top_speed
        return "" if top is None else f"planned up to {_number(top, 'rad/s')}"
    q, v = (np.asarray(x) for x in motion)
    speed = v[:, :, 5] + v[:, :, 3] * np.sin(q[:, :, 4])
    names = response.machine.wiring.stations[: len(response.machine.stations)]
    ranges = zip(names, speed.min(axis=0), speed.max(axis=0))
    told = (f"{name} {_range(low, high)}" for name, low, high in ranges)
    return listed(told, WIDTH - _LABEL - 6) + " rpm"


def _range(low: float, high: float) -> str:
    first, last = (f"{30 / np.pi * x:.4g}" for x in (low, high))
    return first if first == last else f"{first} to {last}"


def _doubts(response: Response) -> list[str]:
    """What the run warned of, as far as its samples show it."""
    found = []
    sample = response.failed_at()
    if sample is not None:
        at = float(np.asarray(response.t)[sample])
        return [f"not finite from t = {at:.6g} s on"]
    for name, at in poles_passed(response.machine, response.t, response.y):
        found.append(f"theta of `{name}` reaches 90 degrees at t = {at:.6g} s")
    words = error_words(response.info)
    return [*found, words] if words else found


def part_text(part: StationResponse | ConnectorResponse) -> str:
    """One part of a run: the quantities that it has, with units."""
    known_units = {
        "x, y, z": "m", "psi, theta, phi": "rad", "speed": "rad/s", "position": "", "velocity": "",
        "acceleration": "", "reaction": "", "power": "W", "mass_centre": "m", "forces": "",
    }  # fmt: skip
    kind = type(part)
    offered = [
        f"{name} [{unit}]" if unit else name
        for name, unit in known_units.items()
        if hasattr(kind, name.partition(",")[0])
    ]
    offered += [f"{name} [{unit}]" if unit else name for name, unit in part.signals().items()]
    count = np.shape(part._response.t)[0]
    title = (
        f"{kind.__name__}: `{part._name}`, a {type(part._element).__name__}, at {count} instants"
    )
    lines = textwrap.wrap(", ".join(offered), WIDTH - 2)
    return "\n".join([title, *(f"  {line}" for line in lines)])
