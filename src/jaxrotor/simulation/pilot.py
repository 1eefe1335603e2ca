"""Pilot runs: what a step's error is, at one instant and speed."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.quick import quickly_compiled
from ..integrators.blocks import blocks_of
from ..integrators.fitted import Method, run_through
from ..integrators.fitted_weights import Parts
from ..integrators.ladder import ladder_of, rung_speeds
from ..machine.field import initial_states, jacobians, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import System
from .assembling import system_of
from .prepared import Known, rungs_of
from .run_error import peaks, share_of_peaks
from .shaken import carried_since, released

# Steps of a pilot.
_STEPS = 96
# Rungs that it knows: those of the highest speeds.
RUNGS = 2


def highest_rungs(machine: Machine, top: float, slowest: float) -> tuple[np.ndarray, np.ndarray]:
    """The rungs that a pilot at `top` (rad/s) knows: speeds (rad/s), and A there."""
    speeds, A = rungs_of(
        system_of(machine, nominal=True), *jax.device_put((np.float64(top), np.float64(slowest)))
    )
    return np.asarray(speeds)[-RUNGS:], np.asarray(A)[-RUNGS:]


@quickly_compiled
def pilots(
    system, instants, abrupt, h, reach, order: int, evaluations: int, known, parts: Parts
) -> Float[Array, ""]:
    """The largest `pilot` of all, each at its own speed and with what is `known` of it. `reach`: these
    speeds, the lowest of the run, and what an excitation swings at, rad/s."""
    speeds, slowest, excitation = reach
    return jnp.max(
        jax.lax.map(
            lambda x: pilot(
                system,
                None,
                x[0],
                abrupt,
                h,
                x[1],
                order,
                evaluations,
                x[2],
                slowest,
                parts,
                excitation,
            ),
            (instants, speeds, known),
        )
    )


def pilot(
    system: System,
    balanced: System | None,
    when,
    abrupt,
    h,
    top,
    order: int,
    evaluations: int,
    known: tuple[Known, Known] | None = None,
    slowest: Float[Array, ""] | float = 0.0,
    parts: Parts | None = None,
    excitation: Float[Array, ""] | float = 0.0,
) -> Float[Array, ""]:
    """Largest difference between steps of h (s) and of half of it, as part of the peak.

    `top`: rad/s, signed. `abrupt`: where the loads act from the first step on; else they come up smoothly.
    `known`: of both steps, and of `parts` of the state; or the system without what turns with the shaft,
    `balanced`. `slowest`: the lowest speed of the run, `excitation`: of a load, rad/s.
    """
    n = n_free(system)
    y0 = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    angle = system.reference(when)[0]
    # as far from a linearisation as a run comes
    speeds = rung_speeds(top, slowest)[-RUNGS:]
    steps = jnp.stack([h, 0.5 * h])
    if known is None:
        assert balanced is not None
        A = jacobians(balanced, speeds)
        both = Known(jnp.stack([A, A]), None)
    else:
        both = jax.tree.map(lambda *x: jnp.stack(x), *known)

    def run(x):
        h, own = x
        A = own.linear

        # at a constant speed, loads as they are at that instant: no jump falls into the pilot. The ground
        # alone moves on
        def turning(t, y):
            reference = (angle + top * t, top, jnp.zeros_like(t))
            dy = relative_field(when, y, released(system, when, t), reference)
            # what acts from the start, or comes up smoothly over half of the steps
            begun = jnp.clip(t / (0.5 * _STEPS * steps[0]), 0.0, 1.0)
            begun = begun**4 * (35 + begun * (-84 + begun * (70 - 20 * begun)))
            linear = A[-1] @ y
            return linear + jnp.where(abrupt, 1.0, begun) * (dy - linear)

        blocks = blocks_of(h, 2 * _STEPS, 1, order, jnp.zeros(0), length=8)
        ladder = ladder_of(
            speeds,
            A,
            h,
            order,
            n,
            blocks,
            start=top,
            chains=own.chains,
            parts=parts,
            excitation=excitation,
        )
        return run_through(turning, ladder, blocks, lambda t, y: top, y0, Method(evaluations)).kept[
            :, :n
        ]

    coarse, fine = jax.lax.map(run, (steps, both))
    error = jnp.max(jnp.abs(coarse[: _STEPS + 1] - fine[::2]), axis=0)
    ground = carried_since(system, when, 0.5 * h * np.arange(fine.shape[0]))
    return share_of_peaks(error, peaks(fine, ground, system), system)
