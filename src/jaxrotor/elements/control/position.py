"""Controllers of one axis of a magnetic bearing: from how far the rotor is off to the current that is wanted.

The error (m) is the setpoint less what is measured, so gains are positive: a positive current pulls towards
where the rotor should be. A controller given in volts becomes one in amperes per metre by the gains of
sensor (V/m) and amplifier (A/V).
"""

import abc
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import number
from ...core.errors import InputError
from ...core.parameter import known, parameter
from ...core.part import Part, as_tuple

Scalar = Float[Array, ""]
States = Float[Array, " m"]


class AbstractPositionController(Part):
    """A controller of one axis. One of your own needs `initial`, `current` and `rates`."""

    @abc.abstractmethod
    def initial(self) -> States:
        """The states at the start; `jnp.zeros(0)` where there are none."""

    @abc.abstractmethod
    def current(self, error: Scalar, state: States) -> Scalar:
        """Current wanted, A, of the error, m."""

    @abc.abstractmethod
    def rates(self, error: Scalar, state: States, excess: Scalar) -> States:
        """Time derivatives of the states. `excess`: current allowed less current wanted, A, at a limit."""


class PID(AbstractPositionController):
    """`kp + ki/s + kd s/(1 + s/w)` of the error, A/m: kp = `proportional`, ki = `integral`, kd =
    `derivative`, w = 2 pi `cutoff` of the derivative's lag.

    Without `integral` (left out) it is a PD controller, and the rotor sags under its weight. At the current's
    limit the integral's share follows what is given at the rate `anti_windup` (1/s; left out:
    integral/proportional): back-calculation, Åström & Hägglund, PID Controllers, sec. 3.5.
    """

    proportional: Scalar = parameter("A/m", positive=True)
    derivative: Scalar = parameter("A*s/m", nonnegative=True, default=0.0)
    cutoff: Scalar = parameter("Hz", positive=True, default=5e3)
    integral: Scalar | None = parameter("A/(m*s)", positive=True, optional=True, default=None)
    anti_windup: Scalar | None = parameter("1/s", nonnegative=True, optional=True, default=None)

    def initial(self) -> States:
        return jnp.zeros(1 if self.integral is None else 2)

    def current(self, error: Scalar, state: States) -> Scalar:
        w = 2 * jnp.pi * self.cutoff
        # states in A: the lag's, and the integral's share
        return (self.proportional + w * self.derivative) * error - state[0] + jnp.sum(state[1:])

    def rates(self, error: Scalar, state: States, excess: Scalar) -> States:
        w = 2 * jnp.pi * self.cutoff
        lag = w * (w * self.derivative * error - state[0])
        if self.integral is None:
            return lag[None]
        back = self.anti_windup
        if back is None:
            back = self.integral / self.proportional
        return jnp.stack([lag, self.integral * error + back * excess])


class TransferFunction(AbstractPositionController):
    """Any proper transfer function: `gain` times `numerator` over `denominator`, polynomials in s (1/s),
    highest power first as in SciPy, A/m in all.

    Poles far apart in one polynomial lose digits: give such a controller as an `InSeries` of shorter ones.
    """

    numerator: Float[Array, " k"] = parameter(shapes=((None,),), label="powers of s, falling")
    denominator: Float[Array, " n"] = parameter(shapes=((None,),), label="powers of s, falling")
    gain: Scalar = parameter("A/m", default=1.0)

    def faults(self) -> Iterator[str]:
        if not self.denominator.size or self.denominator[0] == 0:
            yield "denominator must begin with its highest power, but begins with 0: leave zeros out"
        elif not self.numerator.size:
            yield "numerator must have a coefficient at least, but is empty"
        elif self.numerator.size > self.denominator.size:
            yield (
                "numerator must not be of a higher degree than the denominator, "
                f"{self.denominator.size - 1}, but is of {self.numerator.size - 1}: add a pole that is fast "
                "enough"
            )

    @classmethod
    def from_zeros(
        cls, zeros: Sequence[Any], poles: Sequence[Any], gain: Any = 1.0
    ) -> "TransferFunction":
        """`gain` (of the leading powers of s) times the product of (s - zero) over that of (s - pole), rad/s;
        complex ones in pairs. Differentiable by all of them. Raises `InputError` for zeros or poles that
        lack their partner, and for more zeros than poles."""
        rows = []
        for name, roots in (("zeros", zeros), ("poles", poles)):
            given = jnp.atleast_1d(jnp.asarray(roots, complex))
            numbers = known(given)
            if numbers is not None and numbers.size:
                far = np.abs(np.sort_complex(numbers) - np.sort_complex(numbers.conj()))
                if not np.all(far <= 1e-9 * np.abs(numbers).max()):
                    raise InputError(
                        f"{name} must be real or come in conjugate pairs: add the partner"
                    )
            row = jnp.ones(1, complex)
            for root in given:
                row = jnp.convolve(row, jnp.stack([jnp.ones_like(root), -root]))
            rows.append(row.real)
        if rows[0].size > rows[1].size:
            raise InputError(
                f"zeros must not be more than the poles, {rows[1].size - 1}, but are {rows[0].size - 1}: add "
                "a pole that is fast enough"
            )
        return cls(*rows, number("A/m")(gain, "TransferFunction.from_zeros: gain"))

    def _parts(self) -> tuple[Array, Array, Array, Array]:
        """Frequency that s is measured by; denominator and numerator without their leading entries, of s over
        that frequency, lowest power first; what goes through at once."""
        n = self.denominator.shape[0] - 1
        a = self.denominator / self.denominator[0]
        b = jnp.pad(self.numerator, (n + 1 - self.numerator.shape[0], 0)) / self.denominator[0]
        power = np.arange(n, 0, -1.0)  # of the frequency: of the lowest coefficient first
        low, through = a[:0:-1], b[0]
        w = jnp.ones(())
        if n:  # the geometric mean of the roots that are not zero
            some = low != 0
            sizes = jnp.abs(jnp.where(some, low, 1.0)) ** (1 / power)
            w = jax.lax.stop_gradient(sizes[jnp.argmax(some)])
        return w, low / w**power, (b - through * a)[:0:-1] / w**power, through

    def initial(self) -> States:
        return jnp.zeros(self.denominator.shape[0] - 1)

    def current(self, error: Scalar, state: States) -> Scalar:
        _, _, b, through = self._parts()
        size = _size(b)
        return self.gain * (b / size @ state + through * error)

    def rates(self, error: Scalar, state: States, excess: Scalar) -> States:
        if not state.shape[0]:
            return state
        w, a, b, _ = self._parts()
        last = _size(b) * error - a @ state
        return w * jnp.concatenate([state[1:], last[None]])


def _size(b: Array) -> Array:
    """Puts the states to the size of what comes out."""
    found = jax.lax.stop_gradient(jnp.max(jnp.abs(b), initial=0.0))
    return jnp.where(found > 0, found, 1.0)


class StateSpace(AbstractPositionController):
    """`z' = A z + B error`, current `C z + D error`: A (m, m) in 1/s, B (m,), C (m,), D in A/m."""

    A: Float[Array, "m m"] = parameter(shapes=((None, None),))
    B: Float[Array, " m"] = parameter(shapes=((None,),))
    C: Float[Array, " m"] = parameter(shapes=((None,),))
    D: Scalar = parameter("A/m", default=0.0)

    def faults(self) -> Iterator[str]:
        m = self.C.shape[0]
        if self.A.shape != (m, m) or self.B.shape != (m,):
            yield (
                f"A, B and C must belong together, {m} states by C, but A is {self.A.shape} and B "
                f"{self.B.shape}"
            )

    def initial(self) -> States:
        return jnp.zeros(self.C.shape[0])

    def current(self, error: Scalar, state: States) -> Scalar:
        return self.C @ state + self.D * error

    def rates(self, error: Scalar, state: States, excess: Scalar) -> States:
        return self.A @ state + self.B * error


class InSeries(AbstractPositionController):
    """Controllers one after the other, what one gives being the next one's error: a PID and notches.

    The `excess` at a limit is passed to each as it is: filters behind a PID should have the gain 1 at rest.
    """

    stages: tuple[AbstractPositionController, ...] = eqx.field(converter=as_tuple)

    def faults(self) -> Iterator[str]:
        if not self.stages:
            yield "stages must be one controller at least, but there is none"

    def initial(self) -> States:
        return jnp.concatenate([jnp.zeros(0), *(stage.initial() for stage in self.stages)])

    def _passed(self, error: Scalar, state: States) -> Iterator[tuple[Any, Scalar, States]]:
        """Each stage with what enters it and its states; then what comes out at last."""
        first = 0
        for stage in self.stages:
            last = first + stage.initial().shape[0]
            yield stage, error, state[first:last]
            error = stage.current(error, state[first:last])
            first = last
        yield None, error, state[:0]

    def current(self, error: Scalar, state: States) -> Scalar:
        return list(self._passed(error, state))[-1][1]

    def rates(self, error: Scalar, state: States, excess: Scalar) -> States:
        each = list(self._passed(error, state))[:-1]
        parts = [stage.rates(entering, own, excess) for stage, entering, own in each]
        return jnp.concatenate([jnp.zeros(0), *parts])
