"""Where a run left the tables over speed of its elements."""

import warnings

import numpy as np

from ..machine.machine import Machine
from ..parameter import known
from ..protocol import OverSpeeds
from .response import Response


def warn_beyond_tables(response: Response) -> None:
    """Says once for each element at which speeds the run was outside its table, where the end values hold."""
    machine: Machine = response.machine
    for name, ends, element in zip(
        machine.wiring.connectors, machine.wiring.ends, machine.connectors
    ):
        if not isinstance(element, OverSpeeds):
            continue
        limits = known(element.covered())
        station = machine.wiring.stations[ends[-1][0]]
        speeds = known(response[station].speed)
        if limits is None or speeds is None:
            continue
        speeds = speeds[np.isfinite(speeds)]
        speeds = np.abs(speeds) if type(element).either_way else speeds
        low, high = limits
        beyond = speeds[(speeds < low - 1e-9 * abs(low)) | (speeds > high + 1e-9 * abs(high))]
        if beyond.size:
            warnings.warn(
                f"`{name}`: the run had speeds from {beyond.min():.6g} to {beyond.max():.6g} rad/s "
                f"outside its table, "
                f"{low:.6g} to {high:.6g} rad/s, where its end values hold: extend the table if they do not",
                stacklevel=2,
            )
