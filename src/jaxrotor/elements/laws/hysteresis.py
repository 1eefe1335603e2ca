"""Laws with a memory: relaxing and hysteretic."""

from collections.abc import Iterator

import jax.numpy as jnp

from ...core.parameter import parameter
from ...core.protocol import NonSmooth
from .law import AbstractLaw, Scalar, States


class Maxwell(AbstractLaw):
    """Spring and damper in series: held at rest its force dies away in `damping/stiffness` seconds.

    At the frequency w its dynamic stiffness is `k i w tau/(1 + i w tau)`. The state is the spring's
    own deflection, so the force does not depend on where the hubs started: there it is relaxed.
    """

    stiffness: Scalar = parameter("N*m/rad", positive=True)
    damping: Scalar = parameter("N*m*s/rad", positive=True)

    def initial(self) -> States:
        return jnp.zeros(1)

    def rates(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> States:
        return v - self.stiffness / self.damping * state

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.stiffness * state[0]

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        return 0.5 * self.stiffness * state[0] ** 2

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return (self.stiffness * state[0]) ** 2 / self.damping


class BoucWen(AbstractLaw, NonSmooth):
    """Smooth hysteresis: the force follows `stiffness` at first and `ratio * stiffness` after
    yielding, and leaves the same way when the motion turns.

    `force = ratio k x + (1 - ratio) k x_y z` and
    `z' = (v - (beta |v| z |z|^(n-1) + gamma v |z|^n))/x_y`. With `beta + gamma = 1`, the default, z
    stays within ±1 and `yield_displacement` x_y is what the name says; the larger n, the sharper
    the knee. `|gamma| <= beta`, or it would give energy away.

    Stored is `ratio k x²/2 + (1 - ratio) k x_y² z²/2`. A static start leaves z at 0. Sources: Wen,
    J. Eng. Mech. Div. ASCE 102 (1976) 249; Ismail, Ikhouane & Rodellar, Arch. Comput. Methods Eng.
    16 (2009) 161.
    """

    stiffness: Scalar = parameter("N*m/rad", positive=True)
    ratio: Scalar = parameter(nonnegative=True)
    yield_displacement: Scalar = parameter("rad", positive=True)
    n: Scalar = parameter(positive=True, default=1.0)
    beta: Scalar = parameter(positive=True, default=0.5)
    gamma: Scalar = parameter(default=0.5)

    def faults(self) -> Iterator[str]:
        if float(self.ratio) > 1:
            yield f"ratio must be at most 1, but is {float(self.ratio):g}"
        if float(self.n) < 1:
            yield f"n must be at least 1, but is {float(self.n):g}"
        if abs(float(self.gamma)) > float(self.beta):
            yield (
                f"gamma must lie between -beta and beta (beyond, a loop would give energy away), "
                f"but is {float(self.gamma):g} against {float(self.beta):g}"
            )

    def initial(self) -> States:
        return jnp.zeros(1)

    def rates(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> States:
        size = jnp.abs(state) ** self.n
        slip = self.beta * jnp.abs(v) * jnp.sign(state) * size + self.gamma * v * size
        return (v - slip) / self.yield_displacement

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        hysteretic = (1 - self.ratio) * self.stiffness * self.yield_displacement * state[0]
        return self.ratio * self.stiffness * x + hysteretic

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        bristles = (1 - self.ratio) * (self.yield_displacement * state[0]) ** 2
        return 0.5 * self.stiffness * (self.ratio * x**2 + bristles)

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        z = state[0]
        slipping = jnp.abs(z) ** self.n * (self.beta * jnp.abs(v * z) + self.gamma * v * z)
        return (1 - self.ratio) * self.stiffness * self.yield_displacement * slipping
