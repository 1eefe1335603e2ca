"""A control loop in a computer: it samples, computes, and holds its torque until the next one."""

from collections.abc import Iterator
from functools import partial
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Motion, Sampled, Signalling, Timed, Vec6
from .actuator import Actuator
from .controller import AbstractController
from .feedback import AbstractFeedback, TwistOf
from .loop import fits, ideal, jumps_of, power, put_on


class SampledTorque(AbstractAttachment, Sampled, Timed, Signalling):
    """As `ActiveTorque`, but sampled: at t = 0, `period`, 2 `period`, ... (s) the controller sees the
    measured values, and `delay` (s) later its torque is set and held (zero-order hold). Exactly at these
    instants its states change, and never between.

    **Arguments:**

    - `controller`, `measured`, `actuator`, `between`: as for `ActiveTorque`; limit and lag come behind the
      hold. Between samples a controller's own states advance by one Runge-Kutta step with what was
      sampled held.
    - `period`, `delay`: s, plain numbers: they decide where the solver steps. Their ratio to the sampling of
      the results must be a simple fraction. The delay may be longer than the period.
    - `noise`: standard deviation of each measured value, in its unit, drawn anew at each sample; `seed`
      repeats it.
    - `resolution`: step of the converter for each measured value, in its unit, 0 for none. Its derivative is
      taken as if there were no steps.

    Signals: `torque` on the first station (N·m), `held`: the torque asked of the actuator (N·m), `power`
    put into the shaft (W). Source: Åström & Wittenmark, Computer-Controlled Systems, ch. 2 and 3.
    """

    controller: AbstractController
    period: float = eqx.field(static=True)
    measured: AbstractFeedback = eqx.field(default_factory=TwistOf)
    delay: float = eqx.field(static=True, default=0.0)
    actuator: Actuator = eqx.field(default_factory=ideal)
    noise: Float[Array, " k"] | None = parameter(
        nonnegative=True, shapes=((None,),), optional=True, default=None
    )
    resolution: Float[Array, " k"] | None = parameter(
        nonnegative=True, shapes=((None,),), optional=True, default=None
    )
    between: bool = eqx.field(static=True, default=False)
    seed: int = eqx.field(static=True, default=0)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m", "held": "N*m", "power": "W"}

    def faults(self) -> Iterator[str]:
        for name, least in (("period", 1e-9), ("delay", 0.0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= least:
                words = "positive" if least else "zero or positive"
                yield f"{name} must be a {words} plain number in s, but is {value!r}"
        if isinstance(self.controller, AbstractController):
            yield from fits(self.controller, self.measured)
        for name in ("noise", "resolution"):
            value = getattr(self, name)
            if value is not None and value.shape != (self.measured.count(),):
                yield (
                    f"{name} must have an entry for each of the {self.measured.count()} measured values, but "
                    f"has {value.size}"
                )

    def clocks(self) -> tuple[tuple[float, float], ...]:
        sampling = (float(self.period), 0.0)
        return (sampling, (float(self.period), float(self.delay))) if self.delay else (sampling,)

    def _pending(self) -> int:
        """Samples whose torque has not been set yet, at most."""
        return int(self.delay / self.period + 1e-9) + 1 if self.delay else 0

    def initial(self) -> Float[Array, " k"]:
        held = jnp.zeros(self._pending() + 1)
        return jnp.concatenate([self.actuator.initial(), self.controller.initial(), held])

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        driven, inner, held = self._split(state)
        still = jnp.zeros(inner.shape[0] + held.shape[0])
        return jnp.concatenate([self.actuator.rates(held[-1], driven), still])

    def ticked(
        self,
        clock: int,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        driven, inner, held = self._split(state)
        if clock == 1:
            # what arrives was sampled a whole number of periods earlier, newest first
            return state.at[-1].set(held[self._pending() - 1])
        seen = self._sampled(t, motions)
        wanted = self.controller.torque(seen, inner)
        excess = self.actuator.limited(wanted) - wanted
        inner = _advanced(lambda z: self.controller.rates(seen, z, excess), inner, self.period)
        if self.delay:
            held = jnp.concatenate([wanted[None], held[:-2], held[-1:]])
        else:
            held = wanted[None]
        return jnp.concatenate([driven, inner, held])

    def _sampled(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Array:
        seen = self.measured.values(t, motions)
        if self.noise is not None:
            number = jnp.round(t / self.period).astype(int)
            key = jax.random.fold_in(jax.random.PRNGKey(self.seed), number)
            seen = seen + self.noise * jax.random.normal(key, seen.shape)
        if self.resolution is not None:
            some = self.resolution > 0
            step = jnp.where(some, self.resolution, 1.0)
            stepped = jnp.where(some, jnp.round(seen / step) * step, seen)
            seen = seen + jax.lax.stop_gradient(stepped - seen)
        return seen

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        torque = partial(self.torque, t, motions, state)
        return put_on(torque, motions, self.measured, self.between)

    def times(self) -> Float[Array, " n"]:
        return jumps_of(self.measured)

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the first station, N·m."""
        driven, _, held = self._split(state)
        return self.actuator.torque(held[-1], driven)

    def held(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Asked of the actuator, N·m."""
        return state[-1]

    def power(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Put into the shaft, W."""
        return power(self.torque(t, motions, state), motions, self.between)

    def _split(self, state: Any):
        """The actuator's states, the controller's, those that wait and the one held."""
        first = self.actuator.initial().shape[0]
        last = state.shape[0] - self._pending() - 1
        return state[:first], state[first:last], state[last:]


def _advanced(rates, z: Array, h: float) -> Array:
    """One step of the classical Runge-Kutta method."""
    if not z.shape[0]:
        return z
    a = rates(z)
    b = rates(z + h / 2 * a)
    c = rates(z + h / 2 * b)
    d = rates(z + h * c)
    return z + h / 6 * (a + 2 * b + 2 * c + d)
