"""What makes a sweep this one: a store goes on with it and with no other."""

import dataclasses
import hashlib
import re
from typing import Any

import jax
import numpy as np

from ..simulation.simulation import Simulation
from .batch import Setup
from .cases import Cases


def fingerprint(setup: Setup, cases: Cases, simulation: Simulation) -> dict[str, str]:
    """Of what was asked, alike in every process: what was planned from it is read from the store."""
    asked = dataclasses.replace(simulation, step=None), setup.run.solver
    return {
        "machine": _digest(setup.machine),
        "cases": _digest(dict(cases.values)),
        "outputs": _digest(dict(setup.outputs)),
        "run": _digest((asked, _plain(simulation.step))),
    }


def _plain(step: Any) -> Any:
    """A plan's numbers, or a step."""
    if step is None or isinstance(step, (int, float)):
        return None if step is None else float(step)
    steps = step.substeps if step.span == 1 else step.steps_a_sample
    return (steps, step.order, float(step.speed))


def _digest(x: Any) -> str:
    leaves, structure = jax.tree.flatten(x)
    h = hashlib.sha256(_words(structure))
    for leaf in leaves:
        if isinstance(leaf, (np.ndarray, jax.Array)):
            value = np.asarray(leaf)
            h.update(f"{value.dtype}{value.shape}".encode() + value.tobytes())
        else:
            h.update(_words(leaf))
    return h.hexdigest()[:16]


def _words(x: Any) -> bytes:
    """Without addresses, which functions show in another place each time."""
    return re.sub(r" at 0x[0-9a-f]+", "", str(x) if isinstance(x, str) else repr(x)).encode()
