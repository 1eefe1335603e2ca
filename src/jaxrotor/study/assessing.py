"""What a study's [standards] and [torsional] say of its machine: every finding, and what moves it."""

from ..core.errors import InputError
from ..machine.machine import Machine
from .assess_balance import balance, vibration
from .assess_lateral import lateral
from .assess_stability import loop, stability
from .assess_torsion import torsion
from .assessed import Assessed
from .standards import Standards
from .torsional import Torsional


def assessed(
    machine: Machine, asked: Standards | None, torsional: Torsional | None, moving: bool = True
) -> Assessed:
    """`moving`: whether what moves each number is found too. Raises `InputError` as the checks do."""
    out = Assessed()
    if asked is not None:
        if asked.probes:
            lateral(out, machine, asked, moving)
        if asked.stability is not None:
            out.items += stability(out, machine, asked, asked.stability, moving)
        for one in asked.magnetic:
            out.items.append(loop(machine, one, asked, moving))
        if asked.balance is not None:
            out.items += balance(machine, asked.balance, moving)
        for one in asked.vibration:
            out.items.append(vibration(machine, one, asked, moving))
    if torsional is not None:
        out.items += torsion(out, machine, asked, torsional, moving)
    if not out.items:
        raise InputError(
            "`standards`: names nothing to assess: write probes, [standards.stability], [standards.balance], "
            "[[standards.vibration]] or [[standards.magnetic]]"
        )
    return out
