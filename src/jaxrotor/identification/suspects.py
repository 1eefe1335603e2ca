"""What is wrong with a channel that is not met, in a sentence: each guess is fitted to the channel alone.

A guess counts where it leaves less than half of the squared residual and where that is no chance: by the
Bayesian information criterion (Schwarz, Annals of Statistics 6 (1978) 461), with as many values as would be
independent, for what is left is correlated.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.interpolate
import scipy.optimize

from .fit_by_channel import ChannelFit
from .loss import robust_size

# A guess leaves less than this part of the squared residual, and its criterion is lower by so much.
_LEFT, _DECISIVE = 0.5, 10.0
# A residual of less than this part of the signal is met: what is left is rounding, or does not matter.
_MET = 1e-3
# A gain that differs from 1 by less is that of a calibration, and none of a wrong direction alone.
_SAME = 0.15
# Factors by which records are taken for one another, and how near a gain has to be.
_NEAR = 0.02
_MISTAKES = {
    np.sqrt(2): "amplitude and rms?",
    2.0: "amplitude and peak-to-peak?",
    2 * np.sqrt(2): "peak-to-peak and rms?",
    9.80665: "g and m/s^2?",
    25.4: "mil and um, inch and mm?",
    180 / np.pi: "degrees and radians?",
    1e3: "m, mm and um?",
    1e6: "m and um?",
}
_OF_SPEEDS = {2.0: "two pulses a turn?", 30 / np.pi: "rpm and rad/s?", 60.0: "rpm and Hz?"}
_SPEEDS = ("rad/s", "rpm", "Hz")
# A delay is looked for within this part of the record; a stretch holds still for so many values; spikes stand
# out by so many (robust) standard deviations and are rarer than this.
_LATE, _STILL, _OUT, _RARE = 0.1, 10, 6.0, 0.02


class Seen(NamedTuple):
    """One channel: `measured` and `simulated` (n,), without missing values, at the instants `t` (or speeds,
    where `steady`), with noise of `std`, 0 where it is not known. `others`: name -> the same of those of its
    run that were recorded in the same unit at the same instants."""

    name: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    std: float
    steady: bool = False
    others: Mapping[str, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def vectors(self) -> bool:
        return np.iscomplexobj(self.measured)

    @property
    def residual(self) -> np.ndarray:
        return self.measured - self.simulated


class Guess(NamedTuple):
    """`words` follow the place of the channel; what is `left`, (n,), for so many `unknowns`. `instead`: the
    other channel that the words are about as well. `relative`: were another channel wrong the other way, it
    would look the same."""

    words: str
    left: np.ndarray
    unknowns: int
    instead: str = ""
    relative: bool = False


def _gain(seen: Seen) -> Iterator[Guess]:
    m, s = seen.measured, seen.simulated
    gain = float(np.real(np.vdot(s, m)) / np.real(np.vdot(s, s)))
    if gain == 0.0:
        return
    words = []
    if gain < 0:
        remedy = (
            "" if seen.vectors else ": turn its direction, or set its sensitivity to the negative"
        )
        words.append(f"looks inverted{remedy}")
    if gain > 0 or abs(np.log(-gain)) > _SAME:
        where = (
            f"{seen.name}.unit` and `{seen.name}.reading"
            if seen.vectors
            else f"{seen.name}.sensitivity"
        )
        way = "much" if abs(gain) > 1 else "little"
        words.append(f"reads {_size(gain)} times too {way}{_mistake(gain, seen)}: see `{where}`")
    yield Guess("; it ".join(words), m - gain * s, 1, relative=True)


def _size(gain: float) -> str:
    size = max(abs(gain), 1 / abs(gain))
    return f"{size:.3g}" if size < 100 else f"{size:.0f}"


def _mistake(gain: float, seen: Seen) -> str:
    """What else may have been recorded."""
    speed = seen.unit in _SPEEDS
    known = _OF_SPEEDS if speed else _MISTAKES
    off = {f: abs(abs(np.log(abs(gain))) - np.log(f)) for f in known}
    nearest = min(off, key=lambda f: off[f])
    told = [known[nearest]] if off[nearest] < _NEAR else []
    told += ["another shaft?"] if speed else []
    return f" ({' '.join(told)})" if told else ""


def _offset(seen: Seen) -> Iterator[Guess]:
    offset = np.mean(seen.residual)
    if seen.vectors:
        told = f"{np.abs(offset):.3g} {seen.unit} at {np.rad2deg(np.angle(offset)):.0f} degrees"
        words = f"has a constant vector of {told} in it: a slow roll? (`{seen.name}.subtracted`)"
        yield Guess(words, seen.residual - offset, 2)
    else:
        words = (
            f"has an offset of {offset:.3g} {seen.unit}: give its channel a bias, or let it be looked "
            f"for (`{seen.name}.bias`)"
        )
        yield Guess(words, seen.residual - offset, 1)


def _delay(seen: Seen) -> Iterator[Guess]:
    if seen.steady or seen.vectors:
        return
    t, m = seen.t, seen.measured
    course = scipy.interpolate.CubicSpline(t, seen.simulated, extrapolate=False)

    def left(delay: float) -> np.ndarray:
        shifted = course(np.clip(t - delay, t[0], t[-1]))
        return m - shifted

    step = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1] + 0.5 * step, step)
    a, b = (np.interp(even, t, x - np.mean(x)) for x in (m, seen.simulated))
    n = len(even)
    common = np.fft.irfft(np.fft.rfft(a, 2 * n) * np.conj(np.fft.rfft(b, 2 * n)), 2 * n)
    reach = max(2, int(_LATE * n))
    shifts = np.arange(-reach, reach + 1)
    start = step * shifts[np.argmax(common[shifts])]
    best: Any = scipy.optimize.minimize_scalar(
        lambda d: float(np.sum(left(d) ** 2)),
        bounds=(start - step, start + step),
        method="bounded",
        options={"xatol": 1e-4 * step},
    )
    delay = float(best.x)
    words = (
        f"comes {1e3 * abs(delay):.3g} ms {'late' if delay > 0 else 'early'}: give its channel this delay, "
        f"or let it be looked for (`{seen.name}.delay`)"
    )
    yield Guess(words, left(delay), 1, relative=True)


def _swapped(seen: Seen) -> Iterator[Guess]:
    for other, (measured, simulated) in seen.others.items():
        before = np.sum(np.abs(measured - simulated) ** 2)
        if np.sum(np.abs(measured - seen.simulated) ** 2) < _LEFT * before:
            words = "look swapped: name their columns the other way round"
            yield Guess(words, seen.measured - simulated, 0, other)


def _spikes(seen: Seen) -> Iterator[Guess]:
    r = np.abs(seen.residual)
    level = max(seen.std, robust_size(r))
    out = np.flatnonzero(r > _OUT * level)
    if 0 < out.size <= _RARE * r.size:
        left = seen.residual.copy()
        left[out] = 0.0
        one = out.size == 1
        at = f"{seen.t[out[0]]:.4g} {'rad/s' if seen.steady else 's'}"
        words = (
            f"holds {'a spike' if one else f'{out.size} spikes'}, {'' if one else 'the first '}at {at}: take "
            f'{"it" if one else "them"} out (missing), or use loss="huber"'
        )
        yield Guess(words, left, int(out.size))


def _still(seen: Seen) -> Iterator[Guess]:
    """The longest stretch of one value, where the simulation moves."""
    moves = np.flatnonzero(np.diff(seen.measured) != 0)
    ends = np.concatenate([[-1], moves, [len(seen.measured) - 1]])
    i = int(np.argmax(np.diff(ends)))
    first, last = int(ends[i]) + 1, int(ends[i + 1])
    moved = float(np.std(seen.simulated[first : last + 1]))
    if last - first + 1 < _STILL or moved < max(3 * seen.std, 0.05 * np.std(seen.simulated)):
        return
    left = seen.residual.copy()
    left[first : last + 1] = 0.0
    if last - first + 1 == len(left):
        words = "never changes: is it connected, is the right column named?"
    else:
        words = (
            f"holds still from {seen.t[first]:.4g} to {seen.t[last]:.4g} s: a gap filled with its last "
            "value? mark it as missing (nan)"
        )
    yield Guess(words, left, 1)


def _turned(seen: Seen) -> Iterator[Guess]:
    if not seen.vectors:
        return
    angle = float(np.angle(np.conj(seen.simulated) @ seen.measured))
    words = (
        f"looks turned by {np.rad2deg(angle):.0f} degrees: check the keyphasor's mark "
        f"(`{seen.name}.mark`)"
    )
    yield Guess(words, seen.measured - np.exp(1j * angle) * seen.simulated, 1, relative=True)
    words = (
        f"looks conjugated: a lag taken for a lead, or the other way round (`lag` of {seen.name})"
    )
    yield Guess(words, seen.measured - np.conj(seen.simulated), 0, relative=True)


_GUESSES: tuple[Callable[[Seen], Iterator[Guess]], ...] = (
    _still,
    _gain,
    _turned,
    _offset,
    _delay,
    _swapped,
    _spikes,
)


def suspicion(seen: Seen) -> Guess | None:
    """The guess that explains the residual best, if any does."""
    before = float(np.sum(np.abs(seen.residual) ** 2))
    size = float(np.sum(np.abs(seen.simulated) ** 2))
    if len(seen.t) < _STILL or not before > _MET**2 * size or not size > 0:
        return None
    best, least = None, -_DECISIVE
    for guesses in _GUESSES:
        for guess in guesses(seen):
            after = max(float(np.sum(np.abs(guess.left) ** 2)), 1e-12 * before)
            n = _independent(guess.left)
            criterion = n * np.log(after / before) + guess.unknowns * np.log(n)
            if after < _LEFT * before and criterion < least:
                best, least = guess, criterion
    return best


def _independent(x: np.ndarray) -> float:
    """How many independent values would say as much as these: of a first-order process."""
    power = float(np.sum(np.abs(x) ** 2))
    if power == 0:
        return float(len(x))
    alike = float(np.real(np.conj(x[1:]) @ x[:-1])) / power
    alike = min(max(alike, 0.0), 0.999)
    return max(2.0, len(x) * (1 - alike) / (1 + alike))


def suspects(channels: Sequence[ChannelFit]) -> tuple[str, ...]:
    """A sentence on each channel whose residual looks like one mistake."""
    found = []
    named = sorted({fit.channel for fit in channels})
    for fit in channels:
        there = np.isfinite(fit.measured) & np.isfinite(fit.simulated)
        others = {}
        for o in channels:
            alike = o.run == fit.run and o.unit == fit.unit and o is not fit
            if alike and o.t.shape == fit.t.shape and (o.t == fit.t).all():
                both = there & np.isfinite(o.measured)
                if (both == there).all():
                    others[o.channel] = (o.measured[there], o.simulated[there])
        guess = suspicion(
            Seen(
                fit.channel,
                fit.unit,
                fit.t[there],
                fit.measured[there],
                fit.simulated[there],
                0.0 if fit.sized is None else fit.std,
                fit.over == "speed",
                others,
            )
        )
        if guess is not None:
            names = sorted(filter(None, (fit.channel, guess.instead)))
            told = f"{' and '.join(f'`{n}`' for n in names)} of `{fit.run}` {guess.words}"
            if guess.relative and len(named) == 2:
                (other,) = (n for n in named if n != fit.channel)
                told += f"; or `{other}` is wrong the other way: two channels cannot tell, a third would"
            found.append(told)
    return tuple(dict.fromkeys(found))
