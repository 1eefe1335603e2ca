"""What a figure may show of a run: `part.quantity`, its unit, and its values."""

from typing import Any

import numpy as np

from ..core.protocol import AbstractAttachment, Signalling
from ..machine.lineup import structure_of
from ..machine.machine import Machine

# Of every station. Magnitudes and torques are taken out of what the response holds as vectors.
_STATION = {
    **dict.fromkeys(("x", "y", "z", "radial"), "m"),
    **dict.fromkeys(("psi", "theta", "phi"), "rad"),
    "speed": "rad/s",
    "reaction_torque": "N*m",
    "power": "W",
}
# Of an attachment at one station: what it exerts there.
_ATTACHMENT = {"torque": "N*m", "force": "N"}


def quantities(machine: Machine) -> dict[str, dict[str, str]]:
    """Part -> quantity -> unit, for all parts, those inside composites (`"shaft.3"`) too."""
    lineup = structure_of(machine)
    wiring = lineup.wiring
    stations = [block.element for block in lineup.stations for _ in range(len(block))]
    connectors = [block.element for block in lineup.connectors for _ in range(len(block))]
    found = {}
    for name, element in zip(wiring.stations, stations):
        found[name] = _STATION | _signals(element)
    for name, element, ends in zip(wiring.connectors, connectors, wiring.ends):
        alone = isinstance(element, AbstractAttachment) and len(ends) == 1
        found[name] = (_ATTACHMENT if alone else {}) | _signals(element)
    return found


def _signals(element: Any) -> dict[str, str]:
    return dict(element.signals) if isinstance(element, Signalling) else {}


def split(path: str) -> tuple[str, str]:
    """`"shaft.3.speed"` is the `speed` of `shaft.3`."""
    part, _, quantity = path.rpartition(".")
    return part, quantity


def read_quantity(response: Any, path: str) -> tuple[np.ndarray, str]:
    """(values over time, unit), SI; the magnitude of what is a vector."""
    if path == "t":
        return np.asarray(response.t), "s"
    name, quantity = split(path)
    part, unit = response[name], quantities(response.machine)[name][quantity]
    if quantity in part.signals():
        values = np.asarray(getattr(part, quantity))
        return (values if values.ndim == 1 else np.linalg.norm(values, axis=1)), unit
    if quantity == "radial":
        return np.hypot(np.asarray(part.x), np.asarray(part.y)), unit
    if quantity == "reaction_torque":
        return np.asarray(part.reaction)[:, 5], unit
    if name not in response.lineup.wiring.stations:
        acting = np.asarray(part.forces)[:, 0]
        return (
            acting[:, 5] if quantity == "torque" else np.linalg.norm(acting[:, :3], axis=1)
        ), unit
    return np.asarray(getattr(part, quantity)), unit
