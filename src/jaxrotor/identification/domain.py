"""In what form signals are compared: as they are, by order, by envelope, by frequency. All but the
envelope are linear, and all are applied alike to what was measured and what was simulated."""

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, numbers
from ..core.errors import InputError
from ..core.part import Part, option
from ..sensors.record import Series

Angles = Callable[[np.ndarray], np.ndarray]


class Compared(eqx.Module):
    """What is compared of one signal: `matrix @ values`, or the lengths of its pairs of rows.

    `matrix`: (k, nt), `None` for the values themselves. `spread`: (k,), the standard deviation of each in
    terms of that of one value, for white noise. `t`: (k,), s, or Hz: where each belongs.
    """

    matrix: Float[Array, "k nt"] | None
    spread: Float[Array, " k"]
    t: Float[Array, " k"]
    lengths: bool = eqx.field(static=True, default=False)

    def __call__(self, values: Float[Array, " nt"]) -> Float[Array, " k"]:
        if self.matrix is None:
            return values
        found = self.matrix @ values
        if not self.lengths:
            return found
        half = found.shape[0] // 2
        square = found[:half] ** 2 + found[half:] ** 2
        return jnp.sqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)


class AbstractDomain(Part):
    """A way of comparing signals."""

    @abc.abstractmethod
    def compare(self, series: Series, angles: Angles, place: str) -> Compared:
        """For one measured signal; `angles` gives the shaft's angle (rad) at any instants (s). Raises
        `InputError` where it cannot be compared so: uneven, or too short."""


class Time(AbstractDomain):
    """Value by value: all that was measured counts. From a start too far off, cycles may be skipped:
    compare by order first."""

    def compare(self, series: Series, angles: Angles, place: str) -> Compared:
        rows = 2 if np.iscomplexobj(series.values) else 1  # real parts, then imaginary ones
        return Compared(None, jnp.ones(rows * len(series)), jnp.asarray(np.tile(series.t, rows)))


def _orders(value: Any, place: str) -> tuple[float, ...]:
    return tuple(map(float, np.atleast_1d(numbers("a turn", above=0.0)(value, place))))


class Orders(AbstractDomain):
    """What turns with the shaft: cosine and sine amplitude at `orders` per turn, over windows of some
    `turns` (Gaussian, standard deviation a quarter of it) that follow each other by half their length.

    No cycle can be skipped here. `envelope`: amplitudes alone, without phase.
    """

    orders: tuple[float, ...] = option(_orders, default=(1.0,))
    turns: float = option(number(least=1.0), default=8.0)
    envelope: bool = option(default=False)

    def compare(self, series: Series, angles: Angles, place: str) -> Compared:
        angle = angles(series.t)
        turned = abs(angle[-1] - angle[0]) / (2 * np.pi)
        if turned < 2 * self.turns:
            raise InputError(
                f"{place}: the shaft makes {turned:.1f} turns, too few for windows of {self.turns:g}: "
                "compare over time, or choose fewer `turns`"
            )
        middles = np.arange(self.turns / 2, turned - self.turns / 2, self.turns / 2)
        x = (np.abs(angle - angle[0])[None] / (2 * np.pi) - middles[:, None]) / (self.turns / 4)
        weights = np.where(np.abs(x) < 3, np.exp(-0.5 * x**2), 0.0) * series.valid
        # unequal sampling and a changing speed: each value stands for the angle up to its neighbours
        weights = weights * np.abs(np.gradient(angle))
        enough = np.count_nonzero(weights, axis=1) > 8 * max(self.orders)
        if not enough.any():
            raise InputError(
                f"{place}: has too few values in a turn for order {max(self.orders):g}: sample faster, or "
                "compare over time"
            )
        weights = weights[enough] / weights[enough].sum(axis=1, keepdims=True)
        rows, spreads, at = [], [], []
        middle = weights @ series.t
        for order in self.orders:
            for wave in (np.cos(order * angle), -np.sin(order * angle)):
                rows.append(2 * weights * (wave - (weights @ wave)[:, None]))
                spreads.append(np.linalg.norm(rows[-1], axis=1))
                at.append(middle)
        k = len(self.orders)
        if self.envelope:  # cosines first, then sines
            order = [*range(0, 2 * k, 2), *range(1, 2 * k, 2)]
            rows = [rows[i] for i in order]
            spreads, at = spreads[::2], at[::2]
        return Compared(
            jnp.asarray(np.concatenate(rows)),
            jnp.asarray(np.concatenate(spreads)),
            jnp.asarray(np.concatenate(at)),
            self.envelope,
        )


class Frequencies(AbstractDomain):
    """Fourier coefficients between `low` and `high` (Hz), of evenly spaced samples under a Hann window."""

    low: float = option(number("Hz", least=0.0))
    high: float = option(number("Hz", least=0.0))

    def __check_init__(self) -> None:
        if not 0 <= self.low < self.high:
            raise InputError(f"low and high must rise, but are {self.low!r} and {self.high!r} Hz")

    def compare(self, series: Series, angles: Angles, place: str) -> Compared:
        interval = np.diff(series.t)
        if interval.max() > 1.001 * interval.min() or not series.valid.all():
            raise InputError(
                f"{place}: is not evenly spaced or has gaps: compare over time or by order, or fill it"
            )
        n = len(series)
        lines = np.fft.rfftfreq(n, interval.mean())
        chosen = np.flatnonzero((lines >= self.low) & (lines <= self.high) & (lines > 0))
        if not chosen.size:
            raise InputError(
                f"{place}: has no line between {self.low:g} and {self.high:g} Hz: lines are "
                f"{lines[1]:.3g} Hz apart up to {lines[-1]:.4g} Hz"
            )
        window = np.hanning(n)
        waves = 2 * np.pi * np.outer(lines[chosen], series.t)
        matrix = np.concatenate([np.cos(waves), -np.sin(waves)]) * window * 2 / window.sum()
        return Compared(
            jnp.asarray(matrix),
            jnp.asarray(np.linalg.norm(matrix, axis=1)),
            jnp.asarray(np.tile(lines[chosen], 2)),
        )
