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
# Seconds that compiling takes at least: what ends sooner was compiled before, and ran.
_LEAST = 0.05
# Seconds between two looks, and between two words on a terminal.
_LOOK, _WORD = 0.1, 0.5


class _Notice:
    """One for the process. `spent` on programs that followed each other, until `ended`; when something was
    `said`; when what is going on `began`. A thread looks after it, which ends where nothing goes on."""

    def __init__(self) -> None:
        self.inside, self.muted = False, False
        self.spent, self.ended, self.said = 0.0, 0.0, -_LINE
        self.began: float | None = None
        self._lock, self._watch, self._bar = threading.Lock(), None, None

    def begin(self, began: float) -> None:
        with self._lock:
            self.began = began
            if self._watch is None:
                self._watch = threading.Thread(target=self._look, daemon=True)
                self._watch.start()

    def end(self) -> None:
        with self._lock:
            self.began = None
            if self._bar is not None:
                self._bar.close()
                self._bar = None

    def _look(self) -> None:
        last = time.monotonic()
        while True:
            time.sleep(_LOOK)
            now = time.monotonic()
            with self._lock:
                if self.began is not None:
                    last = now
                    self._say(now)
                elif now - last > _PAUSE:
                    self._watch = None
                    return

    def _say(self, now: float) -> None:
        assert self.began is not None
        waited, terminal = now - self.began, sys.stderr.isatty()
        if waited < (_SILENT if terminal else _LINE) or now - self.said < (
            _WORD if terminal else _LINE
        ):
            return
        self.said = now
        text = (
            f"compiling, {waited:.0f} s (a machine's first call takes 5 to 20 s; "
            "jr.enable_cache() spares the next process that)"
        )
        if not terminal:
            print(text, file=sys.stderr, flush=True)
            return
        if self._bar is None:
            from tqdm import tqdm  # takes longer to load than most of what nobody waits for

            self._bar = tqdm(bar_format="{desc}", file=sys.stderr, leave=False)
        self._bar.set_description_str(text)


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
    _now.inside = True
    _now.begin(began - _now.spent)
    try:
        yield
    finally:
        _now.end()
        _now.inside, _now.ended = False, time.monotonic()
        if _now.ended - began > _LEAST:
            _now.spent += _now.ended - began
