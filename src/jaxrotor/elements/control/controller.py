"""Controllers: from measured values to the torque that is wanted."""

import abc
from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part

Values = Float[Array, " k"]
States = Float[Array, " m"]


class AbstractController(Part):
    """A controller, which may have states. The torque (N·m) acts on the loop's first station: positive
    drives it in the sense of phi."""

    @abc.abstractmethod
    def initial(self) -> States:
        """The states at the start; `jnp.zeros(0)` where there are none."""

    @abc.abstractmethod
    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        """Torque wanted, N·m."""

    @abc.abstractmethod
    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        """Time derivatives of the states. `excess`: torque given less torque wanted, N·m, where the
        actuator is at its limit."""


class PD(AbstractController):
    """`-(stiffness seen_0 + damping seen_1)`: with `TwistOf` a spring and a damper made by the actuator.
    `stiffness` N·m/rad, `damping` N·m·s/rad."""

    stiffness: Float[Array, ""] = parameter("N*m/rad", default=0.0)
    damping: Float[Array, ""] = parameter("N*m*s/rad", default=0.0)

    def initial(self) -> States:
        return jnp.zeros(0)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return -(self.stiffness * seen[0] + self.damping * seen[1])

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        return jnp.zeros(0)


class PI(AbstractController):
    """`-(proportional e + integral ∫e dt)` of the first measured value e, a `SpeedError`.

    `proportional` N·m·s/rad, `integral` N·m/rad. At the actuator's limit the integral's share follows
    what is given at the rate `anti_windup` (1/s; left out: integral/proportional): back-calculation,
    Åström & Hägglund, PID Controllers, sec. 3.5.
    """

    proportional: Float[Array, ""] = parameter("N*m*s/rad", positive=True)
    integral: Float[Array, ""] = parameter("N*m/rad", nonnegative=True)
    anti_windup: Float[Array, ""] | None = parameter(
        "1/s", nonnegative=True, optional=True, default=None
    )

    def initial(self) -> States:
        return jnp.zeros(1)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return state[0] - self.proportional * seen[0]

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        back = self.anti_windup
        if back is None:
            back = self.integral / self.proportional
        return (back * excess - self.integral * seen[0])[None]


class ResonantController(AbstractController):
    """Damping in a narrow band: `-damping` (N·m·s/rad) times the rate (second measured value) seen through
    `2 z w s/(s² + 2 z w s + w²)`, w = `frequency` (rad/s), z = `bandwidth`: at w it is a damper,
    elsewhere it does nothing. Source: Sievers & von Flotow, J. Sound Vib. 139 (1990) 287."""

    damping: Float[Array, ""] = parameter("N*m*s/rad")
    frequency: Float[Array, ""] = parameter("rad/s", positive=True)
    bandwidth: Float[Array, ""] = parameter(positive=True, default=0.1, label="damping ratio")

    def initial(self) -> States:
        return jnp.zeros(2)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return -self.damping * state[1]

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        w, x, y = self.frequency, state[0], state[1]
        # y is the band-pass of the rate, x its integral times w: both of the size of the rate
        return jnp.stack([w * y, 2 * self.bandwidth * w * (seen[1] - y) - w * x])


class PositivePositionFeedback(AbstractController):
    """`gain` (N·m/rad) times the twist (first measured value) seen through `w²/(s² + 2 z w s + w²)`, fed back
    positively: it rolls off above w = `frequency` (rad/s), so it cannot excite higher modes. Stable while
    `gain` is below the stiffness that it works against. Source: Fanson & Caughey, AIAA J. 28 (1990) 717."""

    gain: Float[Array, ""] = parameter("N*m/rad")
    frequency: Float[Array, ""] = parameter("rad/s", positive=True)
    damping_ratio: Float[Array, ""] = parameter(positive=True, default=0.3)

    def initial(self) -> States:
        return jnp.zeros(2)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return self.gain * state[0]

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        w, x, y = self.frequency, state[0], state[1]
        return jnp.stack([w * y, w * (seen[0] - x) - 2 * self.damping_ratio * w * y])


class StateFeedback(AbstractController):
    """`-gains · seen`: one gain for each measured value (N·m per unit of it)."""

    gains: Float[Array, " k"] = parameter(shapes=((None,),), label="N*m per unit of each value")

    def initial(self) -> States:
        return jnp.zeros(0)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return -(self.gains @ seen)

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        return jnp.zeros(0)


class Compensator(AbstractController):
    """Any linear controller, `z' = A z + B seen`, torque `C z` (N·m): what `jr.linear.lqg` gives. `A` (m, m),
    `B` (m, k), `C` (m,) or of one row (1, m), SI. Of several rows, for as many actuators, no loop takes it.
    """

    A: Float[Array, "m m"] = parameter(shapes=((None, None),))
    B: Float[Array, "m k"] = parameter(shapes=((None, None),))
    C: Float[Array, " m"] | Float[Array, "1 m"] = parameter(shapes=((None,), (None, None)))

    def initial(self) -> States:
        return jnp.zeros(self.C.shape[-1])

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        return jnp.sum(self.C @ state)

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        return self.A @ state + self.B @ seen

    def faults(self) -> Iterator[str]:
        m = self.C.shape[-1]
        if self.C.ndim == 2 and self.C.shape[0] != 1:
            yield f"C must be one row, for one torque, but has {self.C.shape[0]}: give each loop its own"
        if self.A.shape != (m, m) or self.B.shape[0] != m:
            yield (
                f"A, B and C must belong together, {m} states by C, but A is {self.A.shape} and B "
                f"{self.B.shape}"
            )
