"""How far a long run is, told from inside the compiled loop: a bar on a terminal, lines in a file."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from tqdm import tqdm

# Steps that two seconds last for, on a small machine: beyond that progress is shown.
_TWO_SECONDS = 160_000
# Seconds between two looks at a bar, and between two lines.
_BAR, _LINE = 0.5, 10.0

_shown: "_Progress | None" = None


class _Progress:
    """Until the loop's first word the run is being compiled, which is most of a short one."""

    def __init__(self, samples: int, wait: float):
        self.samples, self.wait = samples, wait
        self.done: int | None = None
        self.began, self.over = time.monotonic(), threading.Event()
        self.bar: tqdm | None = None
        self.thread = threading.Thread(target=self._watch, daemon=True)
        self.thread.start()

    def _watch(self) -> None:
        terminal = sys.stderr.isatty()
        pause = self.wait if terminal else _LINE
        while not self.over.wait(pause):
            (self._draw if terminal else self._line)()
            pause = _BAR if terminal else _LINE

    def _draw(self) -> None:
        if self.bar is None:
            self.bar = tqdm(total=self.samples, unit="sample", file=sys.stderr, leave=False)
        self.bar.set_description_str("compiling" if self.done is None else "", refresh=False)
        self.bar.n = self.done or 0
        self.bar.refresh()

    def _line(self) -> None:
        what = "compiling" if self.done is None else f"{self.done} of {self.samples} samples"
        print(f"{what}, {time.monotonic() - self.began:.0f} s", file=sys.stderr, flush=True)

    def close(self) -> None:
        self.over.set()
        self.thread.join()
        if self.bar is not None:
            self.bar.close()


@contextmanager
def progress_bar(samples: int, steps: int | None, wanted: bool | None) -> Iterator[int]:
    """How often the loop should report, in samples; 0 where nothing is shown.

    `steps` are those expected, `None` where the solver finds its own. `wanted` is the user's word; `None`
    shows progress where the run will last. Where the errors go to a file it gets a line each ten seconds.
    """
    global _shown
    lasts = steps is None or steps > _TWO_SECONDS
    if not (wanted or (wanted is None and lasts)):
        yield 0
        return
    _shown = _Progress(samples, 2.0 if steps is None and not wanted else 0.0)
    try:
        yield max(1, samples // 200)
    finally:
        _shown.close()
        _shown = None


def report(sample, every: int) -> None:
    """Called in the traced loop: tells of every so many samples."""
    jax.lax.cond(sample % every == 0, lambda: jax.debug.callback(_move, sample), lambda: None)


class _Meter(diffrax.AbstractProgressMeter):
    """The same for `diffrax.diffeqsolve`; `samples` is all of it."""

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
    """What tells how far an adaptive solver is."""
    return _Meter(samples) if every else None


def _move(sample) -> None:
    if _shown is not None:
        _shown.done = max(int(sample), _shown.done or 0)
