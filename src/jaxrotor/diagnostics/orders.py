"""Order tracking: amplitude and phase of what repeats so many times in a turn."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import TURN
from ..core.result_text import shows
from . import checks
from .shaft_angle import Turning

# Samples in a period of the highest order that are the fewest: below, splines between them go wrong.
_IN_A_PERIOD = 4
# Steps in a turn after resampling.
_LEAST_STEPS, _MOST_STEPS = 64, 1024


@shows(speed="rad/s", time="s")
class OrderTrack(NamedTuple):
    """Amplitudes of orders over blocks of whole turns.

    - `orders`: (k,), per turn.
    - `amplitude`: (b, k) complex; the signal is its mean plus the sum over orders of Re(amplitude e^(i order
      phi)), phi the shaft's angle: a phase of -0.5 pi is a quarter period behind the mark at phi = 0.
    - `mean`: (b,), the mean of the signal.
    - `speed`: (b,), rad/s, mean of the block, negative for a shaft that turns towards -phi.
    - `time`: (b,), s from the first sample, in the middle of the block.
    """

    orders: np.ndarray
    amplitude: np.ndarray
    mean: np.ndarray
    speed: np.ndarray
    time: np.ndarray

    plot = plot_door()

    @property
    def magnitude(self) -> np.ndarray:
        """(b, k), in the signal's unit."""
        return np.abs(self.amplitude)

    @property
    def phase(self) -> np.ndarray:
        """(b, k), rad, from -pi to pi."""
        return np.angle(self.amplitude)


@takes(sample_rate=positive("Hz"), turns=whole(1), every=whole(1))
def order_tracking(
    signal: Float[Array | np.ndarray, " n"],
    angle: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    orders: Any = (1.0,),
    turns: int = 4,
    every: int | None = None,
    window: Any = "boxcar",
) -> OrderTrack:
    """Computed order tracking: the signal is resampled at equal steps of the shaft's angle, then each block
    of whole turns is fitted by its mean and all `orders` together (weighted least squares).

    **Arguments:**

    - `signal`: (nt,), any unit, at `sample_rate` (Hz).
    - `angle`: (nt,), rad, of the shaft at the same samples: not folded at 2 pi, never turning back.
    - `orders`: per turn, whole or not; each at least 1/turns, and so far apart from the next.
    - `turns`: of a block. More tell orders better apart and smear what changes.
    - `every`: turns from one block's start to the next one's; by default blocks follow each other.
    - `window`: weights in a block. With `"boxcar"` other whole orders leave no trace at all; `"hann"` keeps
      out what is locked to no order (resonances that ring) over four turns or more.

    Exact for amplitudes that are constant within a block, but for the splines between samples: the error is
    3e-6 of the amplitude with 10 samples in a period of that order, 3e-4 with 5. Raises `InputError` for
    fewer than 4, a shaft that turns back, too few turns, or orders that blocks cannot tell apart. `Orders`
    compares by the same amplitudes, as a linear map of unequally spaced records, with Gaussian weights.

    Source: Fyfe, Munck, Analysis of computed order tracking, Mech. Syst. Signal Process. 11 (1997) 187.
    """
    turning = Turning(angle, sample_rate)
    values = checks.signal(signal, "signal", like=turning.angle)
    found = track(turning, values[:, None], orders, turns, every, window)
    return found._replace(amplitude=found.amplitude[..., 0], mean=found.mean[:, 0])


def track(
    turning: Turning, values: np.ndarray, orders: Any, turns: int, every: int | None, window: Any
) -> OrderTrack:
    """Of several signals (nt, m): amplitude (b, k, m), mean (b, m)."""
    wanted = checks.orders(orders)
    every = turns if every is None else every
    _check_apart(wanted, turns)
    _check_sampling(turning, float(wanted.max()))
    blocks = blocks_of(turning, values, turns, every, float(wanted.max()))
    steps = blocks.values.shape[1]
    along = TURN * turns / steps * np.arange(steps)
    waves = [f(order * along) for order in wanted for f in (np.cos, lambda a: -np.sin(a))]
    fit = _fit(np.stack([np.ones(steps), *waves], axis=1), checks.window(window, steps))
    parts = np.einsum("cs,bsm->bcm", fit, blocks.values)
    local = parts[:, 1::2] + 1j * parts[:, 2::2]
    # each block began at its own mark
    amplitude = local * np.exp(-1j * np.outer(blocks.start, wanted))[:, :, None]
    if turning.sense < 0:
        amplitude = amplitude.conj()
    return OrderTrack(wanted, amplitude, parts[:, 0], blocks.speed, blocks.time)


class Blocks(NamedTuple):
    """`values`: (b, steps, m), at equal steps of the angle; `start`: (b,), rad turned at the first of them;
    `speed`: (b,), rad/s; `time`: (b,), s."""

    values: np.ndarray
    start: np.ndarray
    speed: np.ndarray
    time: np.ndarray


def blocks_of(
    turning: Turning, values: np.ndarray, turns: int, every: int, highest: float = 1.0
) -> Blocks:
    """Whole turns from mark to mark, `values` (nt, m) resampled at equal angles."""
    marks = turning.marks()
    whole = marks.size - 1
    if whole < turns:
        raise InputError(
            f"`turns`: must fit into the record, which has {max(whole, 0)} whole turns from mark to mark, "
            f"but is {turns}: choose fewer, or run longer"
        )
    instants = turning.instants(marks)
    # nothing that the samples can hold falls back onto an order that is asked for
    needed = turning.sample_rate * float(np.diff(instants).max()) / 2 + highest + 1
    least = max(_LEAST_STEPS, 8 * highest)
    steps = 2 ** int(np.ceil(np.log2(np.clip(needed, least, max(_MOST_STEPS, least)))))
    grid = marks[:-1, None] + TURN / steps * np.arange(steps)
    at = turning.at(values, turning.instants(grid))
    starts = np.arange(0, whole - turns + 1, every)
    rows = starts[:, None] + np.arange(turns)
    begin, end = instants[starts], instants[starts + turns]
    speed = turning.sense * TURN * turns / (end - begin)
    joined = at[rows].reshape(starts.size, turns * steps, values.shape[1])
    return Blocks(joined, marks[starts], speed, 0.5 * (begin + end))


def _check_sampling(turning: Turning, highest: float) -> None:
    in_a_period = turning.sample_rate * TURN / (highest * turning.top_speed())
    if in_a_period < _IN_A_PERIOD:
        raise InputError(
            f"`sample_rate`: must give {_IN_A_PERIOD} samples in a period of the highest order at least, but "
            f"order {highest:g} at {turning.top_speed():.4g} rad/s has {in_a_period:.2g}: sample faster, or "
            "ask for lower orders"
        )


def _check_apart(orders: np.ndarray, turns: int) -> None:
    apart = float(np.diff(np.sort(orders), prepend=0.0).min())
    if apart * turns < 1 - 1e-9:
        raise InputError(
            f"`orders`: must lie 1/{turns} from 0 and from each other at least to be told apart in blocks of "
            f"{turns} turns, but two are {apart:.3g} apart: take longer blocks (`turns`), or fewer orders"
        )


def _fit(columns: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(c, steps): from the samples of a block to its mean and the parts of its orders."""
    root = np.sqrt(np.maximum(weights, 0.0))[:, None]
    size = np.linalg.norm(root * columns, axis=0)
    return np.linalg.pinv(root * columns / size) / size[:, None] * root.T
