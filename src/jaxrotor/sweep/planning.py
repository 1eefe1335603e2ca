"""The step of each machine of a sweep: those that need a finer one are run together."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import InputError
from ..machine.machine import Machine
from ..solve.plan import BUCKETS, Plan, _pilot
from .batch import placed

_BATCH = 64


@eqx.filter_jit
def _pilots(machine: Machine, values: dict, at: Any, order: int):
    def one(own):
        return _pilot(placed(machine, own), at[0], at[1], at[2], at[3], order)

    return jax.vmap(one)(values)


def substeps_of(
    machine: Machine, values: dict[str, np.ndarray], plan: Plan, when: float, interval: float
) -> np.ndarray:
    """Steps in a sample interval that each machine needs for the plan's tolerance: the plan's own, or more.

    Each is tried in a pilot at the plan's top speed with the plan's step, then those that miss the tolerance with
    the next finer one. Raises `InputError` where some never meets it.
    """
    n = next(iter(values.values())).size
    found = np.zeros(n, int)
    left = np.arange(n)
    sizes = [size for size in BUCKETS if size >= plan.substeps] or [plan.substeps]
    for size in sizes:
        at = [jnp.asarray(x) for x in (when, interval, size, plan.top_speed)]
        errors = []
        for first in range(0, left.size, _BATCH):
            rows = left[np.minimum(np.arange(first, first + _BATCH), left.size - 1)]
            batch = {path: jnp.asarray(x[rows]) for path, x in values.items()}
            got = np.asarray(_pilots(machine, batch, at, plan.order))
            errors.append(got[: left.size - first])
        good = np.concatenate(errors) <= plan.tolerance
        found[left[good]] = size
        left = left[~good]
        if not left.size:
            return found
    raise InputError(
        f"case {left[0] + 1}: no step was found that keeps the error below {plan.tolerance:g}: raise the sample "
        "rate, or choose a solver for stiff nonlinearity such as diffrax.Kvaerno5()"
    )
