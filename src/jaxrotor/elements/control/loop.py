"""A control loop in continuous time that puts a torque on the shaft."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Motion, Signalling, Stateful, Timed, Vec6
from ...profiles.schedule import AbstractSchedule
from .actuator import Actuator
from .controller import AbstractController
from .feedback import AbstractFeedback, TwistOf
from .low_pass import low_pass_rates


def ideal() -> Actuator:
    return Actuator()


def shared(torque: Array, count: int, between: bool) -> tuple[Vec6, ...]:
    """The torque on the first of `count` stations, and where it acts between two its reaction on the
    second."""
    one = torque * jnp.array([0.0, 0, 0, 0, 0, 1])
    rest = [jnp.zeros(6)] * (count - 1)
    if between:
        rest[0] = -one
    return (one, *rest)


def put_on(
    torque: Callable[[], Array],
    motions: tuple[Motion, ...],
    measured: AbstractFeedback,
    between: bool,
) -> tuple[Vec6, ...]:
    """The torque of a loop on its stations; where they are too few, nothing on as many as are needed, for the
    machine to say so."""
    needed = max(1 + between, measured.stations_needed())
    if len(motions) < needed:
        return (jnp.zeros(6),) * needed
    return shared(torque(), len(motions), between)


def fits(controller: AbstractController, measured: AbstractFeedback):
    """Faults of a controller that cannot take what is measured."""
    seen = jnp.zeros(measured.count())
    try:
        shape = jax.eval_shape(lambda c: c.torque(seen, c.initial()), controller).shape
        words = f"makes {shape} of them" if shape else ""
    except (TypeError, ValueError, IndexError):
        words = "cannot take them"
    if words:
        yield (
            f"controller must make one torque of {seen.size} measured value{'s' * (seen.size > 1)} "
            f"({type(measured).__name__}), but a {type(controller).__name__} {words}"
        )


def power(torque: Array, motions: tuple[Motion, ...], between: bool) -> Array:
    """W, put into the shaft."""
    speed = motions[0][1][5]
    return torque * (speed - motions[1][1][5] if between else speed)


def jumps_of(measured: AbstractFeedback) -> Float[Array, " n"]:
    """Instants at which a setpoint jumps."""
    parts = [x.jumps() for x in vars(measured).values() if isinstance(x, AbstractSchedule)]
    return jnp.concatenate([jnp.zeros(0), *parts])


class ActiveTorque(AbstractAttachment, Stateful, Timed, Signalling):
    """A torque that a controller sets: on its first station against the ground, or against its second
    station (`between`). Further stations are measured alone.

    **Arguments:**

    - `controller`: from what is measured to the torque wanted, such as `PD(damping=0.5)`.
    - `measured`: by default the twist between the first two stations and its rate.
    - `actuator`: limit, lag, delay; ideal by default.
    - `between`: whether the second station bears the reaction; else the ground does.
    - `cutoff`: Hz, of a second-order Butterworth low-pass on every measured value; none by default.

    Stations are named where it is attached: `(ActiveTorque(PD(damping=0.5)), ("main", "end"))`.
    Signals: `torque` on the first station and `wanted` (N·m), `power` put into the shaft (W).
    """

    controller: AbstractController
    measured: AbstractFeedback = eqx.field(default_factory=TwistOf)
    actuator: Actuator = eqx.field(default_factory=ideal)
    between: bool = eqx.field(static=True, default=False)
    cutoff: Float[Array, ""] | None = parameter("Hz", positive=True, optional=True, default=None)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m", "wanted": "N*m", "power": "W"}

    def faults(self) -> Iterator[str]:
        if isinstance(self.controller, AbstractController):
            yield from fits(self.controller, self.measured)

    def initial(self) -> Float[Array, " k"]:
        filtered = 0 if self.cutoff is None else 2 * self.measured.count()
        return jnp.concatenate(
            [jnp.zeros(filtered), self.controller.initial(), self.actuator.initial()]
        )

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        seen, wanted, inner, driven = self._parts(t, motions, state)
        parts = []
        if self.cutoff is not None:
            raw, rate = self.measured.values(t, motions), state[seen.shape[0] : 2 * seen.shape[0]]
            parts = [*low_pass_rates(self.cutoff, raw, seen, rate)]
        excess = self.actuator.limited(wanted) - wanted
        parts += [self.controller.rates(seen, inner, excess), self.actuator.rates(wanted, driven)]
        return jnp.concatenate(parts)

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
        _, wanted, _, driven = self._parts(t, motions, state)
        return self.actuator.torque(wanted, driven)

    def wanted(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """What the controller asks for, N·m."""
        return self._parts(t, motions, state)[1]

    def power(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Put into the shaft, W."""
        return power(self.torque(t, motions, state), motions, self.between)

    def _parts(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any):
        """What the controller sees, what it wants, its states, the actuator's."""
        seen = self.measured.values(t, motions)
        first = 0
        if self.cutoff is not None:
            seen, first = state[: seen.shape[0]], 2 * seen.shape[0]
        last = first + self.controller.initial().shape[0]
        # a loop without any state is handed None
        inner = jnp.zeros(0) if state is None else state[first:last]
        driven = jnp.zeros(0) if state is None else state[last:]
        return seen, self.controller.torque(seen, inner), inner, driven
