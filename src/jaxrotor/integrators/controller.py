"""The step's length by its error, given up where no step is short enough."""

from typing import Any

import diffrax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

# Steps in turn that are too short for the clock, after which the run ends there.
_PATIENCE = 30
_CLOCK = 8 * 2.0**-52


def adapting(rtol: Any, atol: Any, **options: Any) -> diffrax.AbstractStepSizeController:
    """A `diffrax.PIDController` that ends (`RESULTS.dt_min_reached`) where steps no longer move the clock:
    before a force that has no value, or one that is infinitely steep. It would try for ever."""
    return _Ending(diffrax.PIDController(rtol, atol, norm=_size, **options))  # pyright: ignore[reportCallIssue]


def _size(x: Any) -> Array:
    """The root mean square, and infinite where that is not a number: then the step shrinks."""
    size = optx.rms_norm(x)
    return jnp.where(jnp.isnan(size), jnp.inf, size)


class _Ending(diffrax.AbstractAdaptiveStepSizeController):
    controller: diffrax.PIDController

    @property
    def rtol(self):  # pyright: ignore[reportIncompatibleMethodOverride]
        return self.controller.rtol

    @property
    def atol(self):  # pyright: ignore[reportIncompatibleMethodOverride]
        return self.controller.atol

    @property
    def norm(self):  # pyright: ignore[reportIncompatibleMethodOverride]
        return self.controller.norm

    def wrap(self, direction):
        return _Ending(self.controller.wrap(direction))  # pyright: ignore[reportCallIssue]

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):
        end, state = self.controller.init(terms, t0, t1, y0, dt0, args, func, error_order)
        return end, (state, jnp.zeros((), int))

    def adapt_step_size(
        self, t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state
    ):
        state, still = controller_state
        *found, state, result = self.controller.adapt_step_size(
            t0, t1, y0, y1_candidate, args, y_error, error_order, state
        )
        # behind a jump a step may be as short once: one that was clipped to end there
        still = jnp.where(t1 - t0 <= _CLOCK * jnp.abs(t1), still + 1, 0)
        ended = diffrax.RESULTS.where(still > _PATIENCE, diffrax.RESULTS.dt_min_reached, result)
        return (*found, (state, still), ended)
