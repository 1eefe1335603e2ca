"""What [torsional] asks of the machine at its speeds: all that excites, and lives at meetings."""

import functools
from collections.abc import Callable, Iterator

import numpy as np

from ..machine.machine import Machine
from ..standards.finding import Assessment, Finding
from ..standards.torsional import (
    TorsionalExcitation,
    excitation_bands,
    natural_torsion,
    torsional_excitations,
    torsional_margin,
)
from ..standards.torsional_life import torsional_life
from .torsional import Exciting, StrengthOfShaft, Torsional


def excitations_of(
    machine: Machine, asked: Torsional, speeds: tuple[float, float]
) -> tuple[TorsionalExcitation, ...]:
    """The usual ones and the study's own; what is among both goes by its own name there."""
    own = tuple(one.excitation for one in asked.excitations)
    usual = torsional_excitations(machine, asked.line_frequency, asked.orders, asked.mesh)
    bands = np.asarray(excitation_bands(machine, (*usual, *own), speeds))
    mine = bands[len(usual) :]
    kept = [one for one, band in zip(usual, bands) if not any(np.allclose(band, b) for b in mine)]
    return (*kept, *own)


def lives(
    machine: Machine, asked: Torsional, count: int, speeds: tuple[float, float]
) -> Iterator[tuple[Finding, Callable[[Machine], float]]]:
    """Of the shafts whose `hours` are asked for, where an excitation with a torque is too near to a mode; and
    the room of each for another machine."""
    forced = [one for one in asked.excitations if one.torque is not None]
    wanted = [one for one in asked.shafts if one.hours is not None]
    if not forced or not wanted:
        return
    natural = np.asarray(natural_torsion(machine, 0.5 * sum(speeds), "undeformed"))[:count]
    bands = np.asarray(excitation_bands(machine, [f.excitation for f in forced], speeds))
    for one, band in zip(forced, bands):
        for k, w in enumerate(natural):
            if float(torsional_margin(w, *band)) >= asked.margin:
                continue
            for shaft in wanted:
                life = functools.partial(_life, one, shaft, speeds, k + 1)
                for i, finding in enumerate(life(machine).findings):
                    yield finding, lambda m, of=life, i=i: float(of(m).findings[i].room)


def _life(
    one: Exciting,
    shaft: StrengthOfShaft,
    speeds: tuple[float, float],
    mode: int,
    machine: Machine,
) -> Assessment:
    return torsional_life(
        machine,
        one.excitation,
        one.torque,
        one.station,
        shaft.name,
        speeds,
        shaft.curve,
        shaft.hours or 0.0,
        mode,
        shaft.diameter,
        shaft.inner_diameter,
        shaft.concentration,
        shaft.mean_torque,
    )
