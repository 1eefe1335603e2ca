"""A progress bar on long runs, told from inside the compiled loop."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import jax
from tqdm import tqdm

# Steps that two seconds last for, on a small machine: beyond that a bar is shown.
_TWO_SECONDS = 160_000

_bar: tqdm | None = None


@contextmanager
def progress_bar(samples: int, steps: int, wanted: bool | None) -> Iterator[int]:
    """How often the loop should report, in samples; 0 where no bar is shown.

    `wanted` is the user's word; `None` shows a bar where the run will last and a person looks on.
    """
    global _bar
    if not (wanted or (wanted is None and steps > _TWO_SECONDS and sys.stderr.isatty())):
        yield 0
        return
    _bar = tqdm(total=samples, unit="sample", file=sys.stderr, leave=False, mininterval=0.1)
    try:
        yield max(1, samples // 200)
        _bar.update(samples - _bar.n)
    finally:
        _bar.close()
        _bar = None


def report(sample, every: int) -> None:
    """Called in the traced loop: moves the bar every so many samples."""
    jax.lax.cond(sample % every == 0, lambda: jax.debug.callback(_move, sample), lambda: None)


def _move(sample) -> None:
    if _bar is not None:
        _bar.update(int(sample) - _bar.n)
