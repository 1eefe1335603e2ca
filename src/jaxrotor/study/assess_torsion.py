"""What [torsional] says: separation, and life where there is none."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..core.errors import InputError
from ..machine.machine import Machine
from ..standards.moves import (
    Moves,
    Numbers,
    Term,
    of_torsion,
    scaled,
)
from ..standards.torsional import excitation_bands, torsional_separation
from .assessed import Assessed, Item, direct
from .standards import Standards
from .torsional import Torsional
from .torsional_checks import excitations_of, lives


def torsion(
    out: Assessed, machine: Machine, asked: Standards | None, torsional: Torsional, moving: bool
) -> Iterator[Item]:
    speeds = torsional.speeds or (None if asked is None else asked.speeds)
    if speeds is None:
        raise InputError(
            '`torsional`: speeds are missing: write speeds = ["1450 rpm", "1500 rpm"] to assess it'
        )
    out.torsional_speeds = speeds
    torsional = replace(torsional, speeds=speeds)
    excitations = excitations_of(machine, torsional, speeds)
    found = torsional_separation(
        machine, speeds, excitations, margin=torsional.margin, count=torsional.modes
    )
    natural = of_torsion(machine, 0.5 * sum(speeds), "undeformed") if moving else []
    bands = np.asarray(excitation_bands(machine, excitations, speeds))
    for k, finding in enumerate(found.findings):
        moves: Moves = ()
        if moving and len(bands):
            w, of_w = natural[k]
            each = np.maximum(1 - w / bands[:, 0], w / bands[:, 1] - 1)
            e = int(np.argmin(each))
            low, high = bands[e]
            below = 1 - w / low > w / high - 1
            moves = scaled(of_w, -1 / low if below else 1 / high)
            one = excitations[e]
            if one.shaft is not None and not one.frequency > 0 and of_w:
                weight = w / low**2 if below else -w / high**2
                moves += scaled(
                    direct(
                        machine, "undeformed",
                        lambda m, one=one, side=int(not below): excitation_bands(m, (one,), speeds)[0, side],
                    ),
                    weight,
                )  # fmt: skip
        yield Item(finding, moves)
    for finding, room in lives(machine, torsional, len(found.findings), speeds):
        of = (Term(1.0, machine, "undeformed", Numbers(room, None)),)
        yield Item(finding, of if moving and np.isfinite(float(finding.value)) else ())
