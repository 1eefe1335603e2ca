"""What [torsional] asks of the machine at its speeds: all that excites, and lives at meetings."""

import numpy as np

from ..machine.machine import Machine
from ..standards.finding import Assessment
from ..standards.torsional import (
    TorsionalExcitation,
    excitation_bands,
    natural_torsion,
    torsional_excitations,
    torsional_margin,
)
from ..standards.torsional_life import torsional_life
from .torsional import Torsional


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
) -> Assessment:
    """Of the shafts whose `hours` are asked for, where an excitation with a torque is too near to a mode."""
    found = Assessment(())
    forced = [one for one in asked.excitations if one.torque is not None]
    wanted = [one for one in asked.shafts if one.hours is not None]
    if not forced or not wanted:
        return found
    natural = np.asarray(natural_torsion(machine, 0.5 * sum(speeds), "undeformed"))[:count]
    bands = np.asarray(excitation_bands(machine, [f.excitation for f in forced], speeds))
    for one, band in zip(forced, bands):
        for k, w in enumerate(natural):
            if float(torsional_margin(w, *band)) >= asked.margin:
                continue
            for shaft in wanted:
                found += torsional_life(
                    machine,
                    one.excitation,
                    one.torque,
                    one.station,
                    shaft.name,
                    speeds,
                    shaft.curve,
                    shaft.hours or 0.0,
                    k + 1,
                    shaft.diameter,
                    shaft.inner_diameter,
                    shaft.concentration,
                    shaft.mean_torque,
                )
    return found
