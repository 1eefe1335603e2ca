"""A word to who waits: programs that are being compiled take seconds in which nothing else is to be seen."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

# Seconds that go without a word, on a terminal and in a file; and between two words there.
_SILENT, _LINE = 3.0, 10.0
# Seconds of a pause that ends what belongs together.
_PAUSE = 2.0


class _Notice:
    """One for the process. `spent` on programs that followed each other, until `ended`; when something was
    `said` in a file."""

    def __init__(self) -> None:
        self.inside, self.muted = False, False
        self.spent, self.ended, self.said = 0.0, 0.0, -_LINE


_now = _Notice()


@contextmanager
def muted(wanted: bool = True) -> Iterator[None]:
    """Nothing is said inside, if so `wanted`."""
    before, _now.muted = _now.muted, _now.muted or wanted
    try:
        yield
    finally:
        _now.muted = before


@contextmanager
def compiling() -> Iterator[None]:
    """Around a program that is compiled for longer than it runs: where such programs, one after the other,
    have lasted for three seconds, stderr says so; in a file for ten."""
    here = threading.current_thread() is threading.main_thread()
    if _now.inside or _now.muted or not here:
        yield
        return
    began = time.monotonic()
    if began - _now.ended > _PAUSE:
        _now.spent = 0.0
    _now.inside, over = True, threading.Event()
    watch = threading.Thread(target=_watch, args=(over, began - _now.spent), daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()
        watch.join()
        _now.inside, _now.ended = False, time.monotonic()
        _now.spent += _now.ended - began


def _watch(over: threading.Event, began: float) -> None:
    terminal, bar = sys.stderr.isatty(), None
    said = began if terminal else began + _LINE - _SILENT
    while not over.wait(max(0.0, said + _SILENT - time.monotonic())):
        text = (
            f"compiling, {time.monotonic() - began:.0f} s (a machine's first call takes 5 to 20 s; "
            "jr.enable_cache() spares the next process that)"
        )
        if terminal:
            if bar is None:
                from tqdm import tqdm  # takes longer to load than most of what nobody waits for

                bar = tqdm(bar_format="{desc}", file=sys.stderr, leave=False)
            bar.set_description_str(text)
            said = time.monotonic() + 0.5 - _SILENT
        else:
            if time.monotonic() - _now.said >= _LINE:
                print(text, file=sys.stderr, flush=True)
                _now.said = time.monotonic()
            said = _now.said + _LINE - _SILENT
    if bar is not None:
        bar.close()
