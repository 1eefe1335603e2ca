"""How many machines fit in a batch."""

import os
from typing import Any

import jax
import numpy as np

from ..core.errors import InputError
from ..machine.field import initial_states, n_free
from ..machine.machine import Machine
from ..machine.system import assemble
from .batch import Setup
from .outputs import all_sensors, needs_run, needs_states

# Of the memory there is, what a batch may take; and machines beyond which nothing is gained.
_SHARE, _MOST = 0.25, 256
# Arrays like the exponential solver's weights of one machine, while they are made.
_WEIGHTS = 60


# Machines of a pilot.
_MOST_AT_ONCE = 64


def check_chunk(chunk: Any) -> None:
    if chunk is None:
        return
    if isinstance(chunk, bool) or not isinstance(chunk, (int, np.integer)) or chunk < 1:
        raise InputError(f"chunk must be a whole number, 1 at least, but is {chunk!r}")


def chunk_size(setup: Setup, chunk: Any, cases: int, width: int) -> int:
    """Machines in a batch: as asked, or by memory; a multiple of `width`, no more than there are."""
    check_chunk(chunk)
    if chunk is None:
        chunk = int(np.clip(_SHARE * _free() / member_bytes(setup), 1, _MOST))
        chunk = 2 ** int(np.log2(chunk))
    chunk = min(int(chunk), cases)
    return -(-chunk // width) * width


def rows_at_once(machine: Machine) -> int:
    """Machines of a pilot, each with weights of its own: a power of two."""
    each = 8.0 * 2 * _WEIGHTS * state_size(machine) ** 2
    return 2 ** int(np.log2(np.clip(_SHARE * _free() / each, 1, _MOST_AT_ONCE)))


def state_size(machine: Machine) -> int:
    system = jax.eval_shape(assemble, machine)
    return 2 * n_free(system) + jax.eval_shape(initial_states, system).shape[0]


def member_bytes(setup: Setup) -> float:
    """About what one machine of a batch takes."""
    runs = any(needs_run(one) for one in setup.outputs.values())
    d = state_size(setup.machine)
    if not runs:
        return 8.0 * 50 * d**2
    sensors = 1 if needs_states(setup.outputs) else len(all_sensors(setup.outputs))
    kept = setup.run.count * (12 * d if needs_states(setup.outputs) else 4 * sensors)
    blocks = np.sqrt(setup.run.count) * 20 * d
    weights = 0 if setup.linear is not None else _WEIGHTS * d**2
    return 8.0 * (kept + blocks + weights)


def _free() -> float:
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (ValueError, OSError, AttributeError):
        return 4e9
