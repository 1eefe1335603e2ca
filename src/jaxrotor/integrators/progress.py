"""How far a long run is, and what it has so far, handed over from inside the compiled loop: a bar on a
terminal, lines in a file, and samples to keep where the run is stopped."""

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from ..core.notice import compiling, muted

# Steps that two seconds last for, on a small machine: beyond that progress is shown.
_TWO_SECONDS = 160_000
# Parts of a run, each of which is handed over when it is done.
PARTS = 200
# Samples that a part has at least where a run may be quick: handing over takes as long as ten steps.
_PART = 64
# Seconds between two looks at a bar, and between two lines.
_BAR, _LINE = 0.5, 10.0

# Seconds that a run gets to end with what it has.
_PATIENCE = 60.0

_under_way: "_Progress | None" = None
_ended = False  # whether a run that lasted is behind us, and only what follows it is missing


class Stopped(Exception):
    """Raised inside the compiled loop, which ends it."""


class Interrupted(KeyboardInterrupt):
    """`value`: what the work gave all the same, soon after; or `None`."""

    def __init__(self, value: Any = None):
        self.value = value
        super().__init__()


class _Progress:
    """Until the loop's first word the run is being compiled, which is most of a short one. `parts`: the
    samples so far by the instant at which each part ended."""

    def __init__(self, samples: int, wait: float | None):
        self.samples, self.wait = samples, wait
        self.done: int | None = None
        self.parts: dict[float, np.ndarray] = {}
        self.stop = False
        self.logged = logging.getLogger("jax").level
        self.began, self.over = time.monotonic(), threading.Event()
        self.bar: tqdm | None = None
        self.thread = threading.Thread(target=self._watch, daemon=True)
        if wait is not None:
            self.thread.start()

    def so_far(self) -> np.ndarray | None:
        """The states at the samples until now, (n, d); `None` where they are too few to look at."""
        kept = [self.parts[t] for t in sorted(self.parts)]
        return np.concatenate(kept) if sum(map(len, kept)) > 2 else None

    def _watch(self) -> None:
        terminal = sys.stderr.isatty()
        pause = (self.wait or 0.0) if terminal else _LINE
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
        if self.wait is not None:
            self.thread.join()
        if self.bar is not None:
            self.bar.close()


@contextmanager
def progress_bar(
    samples: int, steps: int | None, wanted: bool | None
) -> "Iterator[_Progress | None]":
    """Where the loop is to hand over what it has, what takes it: for runs that last, and where somebody
    looks on.

    `steps` are those expected, `None` where the solver finds its own. `wanted` is the user's word; `None`
    shows progress where the run will last. Where the errors go to a file it gets a line each ten seconds.
    """
    global _under_way, _ended
    lasts = steps is None or steps > _TWO_SECONDS
    if not (wanted or lasts):
        # the run is short, but what it is compiled from may not be
        with muted(wanted is False), compiling():
            yield None
        return
    wait = None if wanted is False else 2.0 if steps is None and not wanted else 0.0
    _under_way, _ended = _Progress(samples, wait), False
    try:
        yield _under_way
        _ended = True
    finally:
        _under_way.close()
        logging.getLogger("jax").setLevel(_under_way.logged)
        _under_way = None


def _stop() -> bool:
    """Ends the run under way at the end of its present part: the loop raises, and `simulate` keeps what there
    is. Returns whether there is something to wait for."""
    if (run := _under_way) is not None:
        run.stop = True
        # jax logs an error of a callback with its traceback, which here is none
        logging.getLogger("jax").setLevel(logging.CRITICAL + 1)
        return bool(run.parts)
    return _ended


def part_length(samples: int) -> int:
    """Samples in a part of a run that nobody knows the length of beforehand."""
    return max(_PART, -(-samples // PARTS))


def hand_over(instant, states, sampled) -> None:
    """Called in the traced loop at the end of a part: its states (n, d), and which of them are samples."""
    jax.debug.callback(_take, instant, states, sampled)


def handing(t, y, args) -> Any:
    """For `diffrax.SaveAt`: each state that is saved, handed over."""
    hand_over(t, y[None], jnp.ones(1, bool))
    return y


def _take(instant, states, sampled) -> None:
    run = _under_way
    if run is None:
        return
    kept = np.asarray(states)[np.asarray(sampled)]
    run.parts[float(instant)] = kept
    run.done = (run.done or 0) + len(kept)
    if run.stop:
        raise Stopped


def interruptible(work: Callable[[], Any]) -> Any:
    """`work()`, in another thread: Ctrl-C reaches Python only between compiled calls, and one such call may
    take minutes. A run under way ends with what it has; a second Ctrl-C does not wait for that. Raises
    `Interrupted`, or what the work raised when it was stopped."""
    global _ended
    if threading.current_thread() is not threading.main_thread():
        return work()  # no Ctrl-C comes here
    outcome: dict[str, Any] = {}
    _ended = False
    over, device = threading.Event(), jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]

    def target() -> None:
        try:
            with jax.enable_x64(True), jax.default_device(device):  # each thread's own
                outcome["value"] = work()
        except BaseException as error:
            outcome["error"] = error
        over.set()

    threading.Thread(target=target, daemon=True).start()
    try:
        # not `join`: interrupted, it takes the thread for ended; without a time nothing interrupts it
        while not over.wait(0.1):
            pass
    except KeyboardInterrupt:
        if _stop():
            print(
                "\nkeeping what there is; Ctrl-C again: leave at once", file=sys.stderr, flush=True
            )
            over.wait(_PATIENCE)
        if not isinstance(outcome.get("error"), KeyboardInterrupt):
            raise Interrupted(outcome.get("value")) from None
    if "error" in outcome:
        raise outcome["error"]
    return outcome["value"]
