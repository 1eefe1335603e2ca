"""A progress bar on long runs, told from inside the compiled loop."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from tqdm import tqdm

# Steps that two seconds last for, on a small machine: beyond that a bar is shown.
_TWO_SECONDS = 160_000

_bar: tqdm | None = None


@contextmanager
def progress_bar(samples: int, steps: int | None, wanted: bool | None) -> Iterator[int]:
    """How often the loop should report, in samples; 0 where no bar is shown.

    `steps` are those expected, `None` where the solver finds its own. `wanted` is the user's word;
    `None` shows a bar where the run will last and a person looks on.
    """
    global _bar
    lasts = steps is None or steps > _TWO_SECONDS
    if not (wanted or (wanted is None and lasts and sys.stderr.isatty())):
        yield 0
        return
    wait = 2.0 if steps is None and not wanted else 0.0
    _bar = tqdm(
        total=samples, unit="sample", file=sys.stderr, leave=False, mininterval=0.1, delay=wait
    )
    try:
        yield max(1, samples // 200)
        _bar.update(samples - _bar.n)
    finally:
        _bar.close()
        _bar = None


def report(sample, every: int) -> None:
    """Called in the traced loop: moves the bar every so many samples."""
    jax.lax.cond(sample % every == 0, lambda: jax.debug.callback(_move, sample), lambda: None)


class _Meter(diffrax.AbstractProgressMeter):
    """The same bar for `diffrax.diffeqsolve`; `samples` is all of it."""

    samples: int = eqx.field(static=True)

    def init(self):
        return jnp.zeros((), int)

    def step(self, state, progress):
        sample = jnp.asarray(progress * self.samples).astype(int)
        jax.lax.cond(state % 50 == 0, lambda: jax.debug.callback(_move, sample), lambda: None)
        return state + 1

    def close(self, state):
        pass


def meter(samples: int, every: int) -> diffrax.AbstractProgressMeter | None:
    """What tells the bar how far an adaptive solver is."""
    return _Meter(samples) if every else None


def _move(sample) -> None:
    if _bar is not None:
        _bar.update(int(sample) - _bar.n)
