"""Was a finished run one?"""

import warnings

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.errors import ConvergenceError, InputError, SimulationFailed
from ..core.parameter import numbers
from ..machine.layout import count_of_free, layout_of
from ..machine.machine import Machine
from .attitude import poles_passed
from .blame import not_finite
from .equilibrium import refuse_unbalanced
from .response import Response

# A periodic whirl found by shooting must come back to this part of its size.
STEADY_GAP = 1e-7


def speed_reached(response: Response) -> float | None:
    """The highest speed (rad/s) of a line without a drive; `None` where a drive holds it."""
    if response.machine.is_driven:
        return None
    layout = layout_of(response.machine)
    free = np.array(layout.free, dtype=int)
    rates = numbers(response.y)[:, free.size : 2 * free.size][:, free // layout.n_mass == 5]
    rates = rates[np.isfinite(rates).all(axis=1)]
    return float(np.abs(rates).max(initial=0.0))


def judge(response: Response, initial, checks) -> None:
    """After a concrete run: is it one?"""
    sample = response.failed_at()
    blame = None if sample is None else not_finite(*_around(response, sample))
    if sample == 0 and blame:
        raise InputError(f"{blame} before anything moves: mend its law")
    if isinstance(initial, str) and initial in ("static", "running"):
        refuse_unbalanced(response.machine, checks)
    if isinstance(initial, str) and initial == "steady" and np.isinf(numbers(checks)):
        raise ConvergenceError(
            "no periodic whirl was found: without damping a mode is in resonance at this speed, and its "
            "motion grows with each turn: choose another speed, or give the machine damping"
        )
    if isinstance(initial, str) and initial == "steady" and not numbers(checks) < STEADY_GAP:
        raise ConvergenceError(
            f"no periodic whirl was found: after a turn the state differs by {numbers(checks):.1e} of "
            "its size; the torques on the line do not balance at this speed, or it is unstable there"
        )
    if sample is not None:
        kept = response.until(sample)
        t = numbers(response.t)
        remedy = "take a smaller step (step=...), or look for an instability of the machine there"
        if blame:
            remedy = f"{blame} there, so mend its law"
        for name, at in list(poles_passed(kept.machine, kept.t, kept.y))[:1]:
            remedy += f" (theta of `{name}` had come to 90 degrees at t = {at:.6g} s)"
        raise SimulationFailed(
            f"the run left the finite numbers between t = {t[max(0, sample - 1)]:.6g} s "
            f"and {t[sample]:.6g} s ({response.info.solver}, "
            f"{response.info.substeps or 'adaptive'} steps a sample): {remedy}; "
            f"the {sample} samples before are in the exception's `response`",
            kept,
        )


def _around(response: Response, sample: int) -> tuple[Machine, Array, Array]:
    """The machine, and instants and states on the way out of the finite numbers before `sample`."""
    t, y, last = response.t, response.y, max(0, sample - 1)
    n = count_of_free(response.machine)
    start = jnp.where(jnp.isfinite(y[last]), y[last], 0.0)
    ahead = jnp.concatenate([start[n : 2 * n] * (t[1] - t[0]), jnp.zeros(start.size - n)])
    if last > 0:
        ahead = y[last] - y[last - 1]
    parts = jnp.linspace(0.0, 1.0, 9)
    return response.machine, t[last] + parts * (t[1] - t[0]), start + parts[:, None] * ahead


def tell_attitude(response: Response) -> None:
    """Warns of each station whose theta comes close to a right angle, with the time."""
    for name, at in poles_passed(response.machine, response.t, response.y):
        warnings.warn(
            f"`{name}`: theta reaches 90 degrees at t = {at:.6g} s, where psi and phi turn about the same "
            "axis: from there on the run may be wrong by more than its tolerance; let the body tip about x "
            "instead (turn the machine by 90 degrees about z), or end the run before",
            stacklevel=3,
        )
