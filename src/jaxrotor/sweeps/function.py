"""A sweep as a function of its machine: for gradients through statistics of a batch."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, Unpack

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..core.errors import ConvergenceError
from ..machine.machine import Machine
from ..simulation.simulation import Settings, Simulation
from .batch import linear_part, member, placed, with_steps
from .cases import Cases, as_cases
from .planning import NO_STEP
from .sweep import set_up, simulation_of


def batched(
    machine: Machine,
    parameters: Cases | Mapping[str, Any],
    outputs: Mapping[str, Any],
    simulation: Simulation | None = None,
    **settings: Unpack[Settings],
) -> Callable[[Machine], dict[str, Array]]:
    """The outputs of all cases, (n, ...) each, as a pure function of the machine that they vary.

    It may stand inside `jit` and `grad`: `grad` of a percentile over the cases by a parameter they share.
    The arguments are those of `sweep`; the step is planned once, for the machine given here, and is the
    finest that some case needs. All cases run as one batch. A swept parameter is that of the table, whatever
    the machine has.
    """
    cases = as_cases(parameters)
    setup, substeps = set_up(machine, cases, outputs, simulation_of(simulation, settings))
    if (substeps == NO_STEP).any():
        row = int((substeps == NO_STEP).argmax())
        raise ConvergenceError(
            f"case {row + 1}: no step was found for it: give one, or leave it out"
        )
    own = getattr(setup.run.solver, "linear_part", None) is not None
    if substeps.any():
        setup = with_steps(setup, int(substeps.max()))
    values = {path: jnp.asarray(x) for path, x in cases.values.items()}
    first = {path: x[0] for path, x in values.items()}

    def run(machine: Machine) -> dict[str, Array]:
        ready = dataclasses.replace(setup, machine=machine)
        if setup.linear is not None and not own:
            A = linear_part(placed(machine, first), setup.run)
            ready = dataclasses.replace(ready, linear=A)
        return jax.vmap(lambda one: member(ready, one).values)(values)

    return run
