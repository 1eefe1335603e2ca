"""Where stations stand along the axis."""

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from ..core.protocol import AbstractConnector, Composite

if TYPE_CHECKING:
    from .machine import Machine


def axial_positions(machine: "Machine") -> dict[str, float]:
    """station -> z of its geometric centre, m, from that which stands farthest to the left; those inside
    composites too. What has no length (a coupling, a gear mesh) joins two stations at one place."""
    wiring = machine.wiring
    joined: dict[int, list[tuple[int, float]]] = {}
    for connector, ends in zip(machine.connectors, wiring.ends):
        if isinstance(connector, AbstractConnector):
            (a, left), (b, right) = ends
            apart = (
                port_offset(machine, a, left) + _length(connector) - port_offset(machine, b, right)
            )
            joined.setdefault(a, []).append((b, apart))
            joined.setdefault(b, []).append((a, -apart))
    found: dict[int, float] = {0: 0.0}
    waiting = deque(found)
    while waiting:  # a machine hangs together: every station is reached
        here = waiting.popleft()
        for other, apart in joined.get(here, ()):
            if other not in found:
                found[other] = found[here] + apart
                waiting.append(other)
    for i, (connector, ends) in enumerate(zip(machine.connectors, wiring.ends)):
        if isinstance(connector, Composite):
            each = connector.elements  # pyright: ignore[reportAttributeAccessIssue]
            pieces = np.repeat(_lengths(connector) / each, each)
            start = found[ends[0][0]] + port_offset(machine, *ends[0])
            for k, z in enumerate(start + np.cumsum(pieces)[:-1]):
                found[wiring.inner[i] + k] = float(z)
    # rigidly attached pairs and supports join nothing along the axis
    for i in range(len(wiring.stations)):
        found.setdefault(i, 0.0)
    first = min(found.values())
    return {name: found[i] - first for i, name in enumerate(wiring.stations)}


def _length(connector: AbstractConnector) -> float:
    return float(np.sum(_lengths(connector)))


def _lengths(connector: AbstractConnector) -> np.ndarray:
    return np.atleast_1d(np.asarray(getattr(connector, "length", 0.0), float))


def port_offset(machine: "Machine", station: int, port: str) -> float:
    """How far a port lies from its station's centre along the axis, m."""
    own = (
        machine.stations[station] if station < len(machine.stations) else None
    )  # else inside a shaft
    ends = getattr(own, "ends", None)
    if ends is None or port not in ("left", "right"):
        return 0.0
    return -float(ends[0]) if port == "left" else float(ends[1])
