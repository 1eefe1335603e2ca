"""Laws in one direction: what a joint answers to being stretched or twisted by `x` at the rate `v`.

A coupling takes one law for each direction it likes. Units are declared for a twist (rad, N·m,
N·m/rad); along x, y and z the same law is in m and N, and study files read it so.
"""

import abc
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import COORDINATES
from ...core.parameter import parameter
from ...core.part import Part, as_tuple
from ...core.protocol import NonSmooth
from .touch import area, pressed, pressed_lost

Scalar = Float[Array, ""]
States = Float[Array, " k"]


class AbstractLaw(Part):
    """A force between two hubs in one direction. To write your own, give `force`, `energy` and
    `power_lost`; with states of its own `initial` and `rates` too.

    `x`: displacement of the right hub less the left one's; `v`: its rate. Both may grow without
    bound where a clutch slips: a law that needs no `x` should not use it.
    """

    @abc.abstractmethod
    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        """Positive pulls the hubs together: it pulls the left one along when the right one leads."""

    @abc.abstractmethod
    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        """Energy stored, J; written without using `force`."""

    @abc.abstractmethod
    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        """Power turned into heat, W: `force * v` less the growth of `energy`, written apart."""

    def initial(self) -> States:
        """The states at the start."""
        return jnp.zeros(0)

    def rates(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> States:
        """Time derivatives of the states."""
        return jnp.zeros(0)

    def times(self) -> Float[Array, " n"]:
        """Instants at which the force jumps, s."""
        return jnp.zeros(0)


def share_out(laws: Sequence[AbstractLaw], state: States | None) -> list[States]:
    """Each law's own part of states that were put end to end."""
    parts, first = [], 0
    for law in laws:
        count = law.initial().shape[0]
        parts.append(jnp.zeros(0) if state is None else state[first : first + count])
        first += count
    return parts


def laws_of(part: Any) -> dict[int, AbstractLaw]:
    """The laws that a part holds under the names of its coordinates, by their numbers."""
    laws = {i: getattr(part, name) for i, name in enumerate(COORDINATES)}
    return {i: law for i, law in laws.items() if law is not None}


def each_law(part: Any, state: States | None) -> list[tuple[int, AbstractLaw, States]]:
    """Coordinate, law and own states of each."""
    laws = laws_of(part)
    return [
        (i, law, own) for (i, law), own in zip(laws.items(), share_out([*laws.values()], state))
    ]


def end_to_end(parts: Sequence[Array]) -> Float[Array, " n"]:
    return jnp.concatenate([jnp.zeros(0), *parts])


class KelvinVoigt(AbstractLaw):
    """Spring and damper side by side: `stiffness x + damping v`."""

    stiffness: Scalar = parameter("N*m/rad", nonnegative=True)
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.stiffness * x + self.damping * v

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        return 0.5 * self.stiffness * x**2

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.damping * v**2


class Progressive(AbstractLaw):
    """Odd polynomial `k1 x + k3 x³ + k5 x⁵ + ...` with a viscous damper beside it.

    `coefficients`: k1, k3, k5, ... in N·m/rad, N·m/rad³, ...; a negative one makes it degressive.
    """

    coefficients: Float[Array, " n"] = parameter(shapes=((None,),), label="SI units")
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)

    def faults(self) -> Iterator[str]:
        if self.coefficients.shape[0] == 0:
            yield "coefficients must hold k1 at least, but is empty"

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        total = jnp.zeros_like(x)
        for k in self.coefficients[::-1]:  # Horner in x²
            total = total * x**2 + k
        return total * x + self.damping * v

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        powers = [k * x ** (2 * i + 2) / (2 * i + 2) for i, k in enumerate(self.coefficients)]
        return sum(powers, start=jnp.zeros(()))

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.damping * v**2


class Backlash(AbstractLaw, NonSmooth):
    """Free play: no force within `gap` (its whole width), beyond it a face that pushes and never pulls.

    With `u` how far a face is overlapped it pushes with `k u + c u'`, or with nothing where that would pull
    (a body that leaves quickly lets go before u = 0). Two kinds of damping, alone or together:

    - `damping` c: a damper cut off where it would hold on. The force jumps by `c u'` at the first touch.
      Where the play goes to zero it becomes `KelvinVoigt`, but for the moments in which that would pull.
    - `hysteresis` h: Hunt & Crossley's `k u h u'` (s/rad, s/m), without a jump; for a coefficient of
      restitution r at the impact speed v about `1.5 (1 - r)/v`. It does not become linear as the play goes
      to zero: small vibration is hardly damped.

    A joint without play is a `KelvinVoigt`. `smoothing` (> 0, small against the gap) lets stiffness and
    `damping` grow over that distance to either side of the touch, and rounds off where a face lets go:
    derivatives by `gap` of a run with `damping` are right only then. Source: Hunt & Crossley, J. Appl. Mech.
    42 (1975) 440.
    """

    gap: Scalar = parameter("rad", nonnegative=True)
    stiffness: Scalar = parameter("N*m/rad", positive=True)
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    smoothing: Scalar = parameter("rad", nonnegative=True, default=0.0)
    hysteresis: Scalar = parameter("s/rad", nonnegative=True, default=0.0)

    def _how(self) -> tuple[Scalar, ...]:
        return self.stiffness, self.damping, self.hysteresis, self.smoothing

    def _beyond(self, x) -> tuple[Array, Array]:
        """How far beyond either face."""
        return x - 0.5 * self.gap, -x - 0.5 * self.gap

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        right, left = self._beyond(x)
        return pressed(right, v, *self._how()) - pressed(left, -v, *self._how())

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        right, left = self._beyond(x)
        return self.stiffness * (area(right, self.smoothing) + area(left, self.smoothing))

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        right, left = self._beyond(x)
        return pressed_lost(right, v, *self._how()) + pressed_lost(left, -v, *self._how())


class Parallel(AbstractLaw):
    """Laws side by side: their forces add up.

    A static characteristic with `Maxwell` and `BoucWen` branches beside it depends on amplitude and
    frequency, as rubber does.
    """

    parts: tuple[AbstractLaw, ...] = eqx.field(converter=as_tuple)

    def faults(self) -> Iterator[str]:
        if not self.parts:
            yield "parts must hold one law at least, but is empty"

    def _each(self, state: Any):
        return zip(self.parts, share_out(self.parts, state))

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return sum((law.force(t, x, v, own) for law, own in self._each(state)), start=jnp.zeros(()))

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        return sum((law.energy(t, x, own) for law, own in self._each(state)), start=jnp.zeros(()))

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return sum(
            (law.power_lost(t, x, v, own) for law, own in self._each(state)), start=jnp.zeros(())
        )

    def initial(self) -> States:
        return end_to_end([law.initial() for law in self.parts])

    def rates(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> States:
        return end_to_end([law.rates(t, x, v, own) for law, own in self._each(state)])

    def times(self) -> Float[Array, " n"]:
        return end_to_end([law.times() for law in self.parts])
